"""What `scripts/measure` does: a plan, its units one by one, and the page of what they found."""
