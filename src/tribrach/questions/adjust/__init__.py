"""What are the coordinates of a network, and how sure are they?"""
