import sys
from pathlib import Path

CAMPAIGNS = Path(__file__).parent.parent
sys.path[:0] = [str(CAMPAIGNS), str(CAMPAIGNS.parents[1] / "reports")]
