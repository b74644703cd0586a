"""Readers: from a log file to a `Flight`; `read.read` is the way in.

A reader is a module with `NAME`, `VERSION` (both go into the flight's provenance with the file's hash),
`recognises(source)` and `read(source, options)`. Another package adds one by an entry point of the group
`swashplate.readers`.
"""
