"""The three tactile channels: SA-I, RA-I and RA-II, one file each."""
