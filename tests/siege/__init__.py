"""Campaigns against the program: damaged files, hard kills, full disks, packets and hostile pages. `make siege`."""
