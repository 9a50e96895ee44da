"""Takes the build's folder out of a wheel's bill of materials: `stable_sbom.py WHEEL`.

maturin names the crates of this workspace by where they were built, such as
``path+file:///tmp/tmp.iKR0TP2vAh/hizvk-0.1.0/crates/hiz_py#0.1.0``.
That tells nothing, and is another name in each build.
Here it becomes ``path+file:///crates/hiz_py#0.1.0``.
"""

import base64
import hashlib
import os
import re
import sys
import zipfile
from pathlib import Path

BILL = re.compile(r"[^/]+\.dist-info/sboms/.+\.json")
#: Up to the last folder `crates` before the version.
BUILT_IN = re.compile(rb"path\+file://[^\"#]*?/(?=crates/[\w-]+#)")
PLACELESS = b"path+file:///"


def stable(bill: bytes) -> bytes:
    """The bill of materials with names that every build gives."""
    return BUILT_IN.sub(PLACELESS, bill)


def with_record(record: str, path: str, content: bytes) -> str:
    """The lines of a wheel's RECORD, in which a file has another content."""
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    line = f"{path},sha256={digest},{len(content)}"
    lines = record.splitlines()
    places = [k for k, one in enumerate(lines) if one.startswith(f"{path},")]
    assert len(places) == 1, f"RECORD: expected one line of {path}, got {len(places)}"
    lines[places[0]] = line
    return "\n".join(lines) + "\n"


def main(path: str) -> None:
    """Writes the wheel anew; all else in it stays as it is."""
    with zipfile.ZipFile(path) as wheel:
        entries = [(info, wheel.read(info)) for info in wheel.infolist()]
    bills = {info.filename: stable(data) for info, data in entries if BILL.fullmatch(info.filename)}
    assert bills, f"no bill of materials in {path}"
    made = Path(f"{path}.part")
    with zipfile.ZipFile(made, "w") as wheel:
        for info, data in entries:
            if info.filename.endswith(".dist-info/RECORD"):
                record = data.decode()
                for name, bill in bills.items():
                    record = with_record(record, name, bill)
                data = record.encode()
            wheel.writestr(info, bills.get(info.filename, data))
    os.replace(made, path)
    print(f"{Path(path).name}: {', '.join(sorted(bills))} without the build's folder")


if __name__ == "__main__":
    main(sys.argv[1])
