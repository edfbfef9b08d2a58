"""Where do scans stand by their clouds alone? Pairs, loops, poses with covariances."""
