import sys
from pathlib import Path

CAMPAIGNS = Path(__file__).parent.parent
REPORTS = CAMPAIGNS.parents[1] / "reports"
sys.path[:0] = [str(CAMPAIGNS), str(CAMPAIGNS.parent), str(REPORTS), str(REPORTS / "test")]
