"""What the page is made of, whatever stands on it.

The parts of a section, the template that writes them as HTML, style sheets, scripts.
"""
