"""The command `warmslip`."""
