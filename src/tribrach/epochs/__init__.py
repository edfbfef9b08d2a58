"""Has anything moved? Differences of epochs with their covariance, tested; method chapter 12."""
