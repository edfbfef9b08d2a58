"""The JSON that leaves the program: one versioned model for each document.

Everything that other programs read is declared here, or in the chapter of the report that makes
it, and nowhere taken from the fields of internal classes: a field that is renamed inside changes no
file. Metres, radians and their squares; null where there is no number; names as keys. A document
says which ``schema`` it follows; that number rises when a key or a meaning changes. The JSON
Schemas are published in ``docs/schema``.
"""
