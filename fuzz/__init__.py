"""Mutated files for every reader, read in a process of their own under a watchdog.

``python -m fuzz --reader all --inputs 20000`` makes as many inputs out of the small seeds in
``fuzz/seeds``, the same ones each time, and reads each: it must be read or be refused in a
sentence, within 2 s and 300 MB. CONTRIBUTING.md says how findings become tests.
"""
