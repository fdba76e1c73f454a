"""`python -m tests.golden.make` writes the golden files. Run it only when the contract changes, and read the diff."""

from pathlib import Path

from protocol.codec import encode
from tests.golden.examples import EXAMPLES

FOLDER = Path(__file__).resolve().parent


def main() -> None:
    """Write the message of every example to `<stem>.msgpack`, and remove files without an example."""
    for path in FOLDER.glob("*.msgpack"):
        path.unlink()
    for stem, message in EXAMPLES.items():
        (FOLDER / f"{stem}.msgpack").write_bytes(encode(message))
    print(f"{len(EXAMPLES)} messages in {FOLDER}")


if __name__ == "__main__":
    main()
