"""What lies beside every result: tables of numbers and the stamp that says what made them."""
