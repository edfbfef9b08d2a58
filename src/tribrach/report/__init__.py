"""What an adjustment says: one content model, rendered as HTML, text and JSON."""
