"""What commands share: their options, errors as sentences, and how an answer is delivered."""
