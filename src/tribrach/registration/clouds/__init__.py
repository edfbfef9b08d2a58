"""Registration of whole clouds: surfels, search without approximate poses, fit, covariance."""
