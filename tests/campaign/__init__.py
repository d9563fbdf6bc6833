"""The robustness campaign: scenes all over the space of data, each judged by a solver in 80 digits."""
