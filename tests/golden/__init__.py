"""Golden results: what the code computed when they were frozen, and cases that compute the same again."""
