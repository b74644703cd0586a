"""Campaigns: a file says what is computed many times, processes of one or many machines do it, a folder keeps it."""
