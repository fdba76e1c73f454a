"""Generate the table of docs/reliability.md from its JSON, without measuring: `python -m tools.pages.reliability`."""

import json
from pathlib import Path

from tools.drill.report import write_markdown

PAGE = Path("docs/reliability.md")

if __name__ == "__main__":
    write_markdown(PAGE, json.loads(PAGE.with_suffix(".json").read_text()))
