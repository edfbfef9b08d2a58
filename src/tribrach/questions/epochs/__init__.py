"""Has anything moved between two adjusted epochs or more?"""
