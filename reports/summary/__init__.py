"""Statistics of the records, as numbers: others draw them, or write them as text."""
