"""Do two clouds differ, by how much beside sampling and sigmas, and what has moved?"""
