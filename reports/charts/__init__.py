"""How variants and numbers look: colours, axes, numbers as text, and the charts.

No chart knows in which section it stands.
"""
