"""What numpy is too slow for, compiled: pure functions on numbers and arrays, one a file."""
