"""What a job has to say, in chapters, as HTML, text and JSON."""
