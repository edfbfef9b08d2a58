"""What did a survey see? Surfaces by stations and by sigma, and the gaps between them."""
