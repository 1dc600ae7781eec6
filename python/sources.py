"""A source distribution by maturin -> one that builds: ``sources.py STRAPD.tar.gz``, in place, the same bytes for the same files.

maturin packs the repository's manifest because the crates inherit from it, and not the command, which that manifest is also of: cargo
then finds a package without sources. What the crates inherit is kept, and nothing else.
"""

import gzip
import io
import os
import re
import sys
import tarfile


def inherited(manifest: str) -> str:
    """The tables of the workspace alone."""
    tables = re.split(r"^(?=\[)", manifest, flags=re.MULTILINE)
    kept = "".join(table for table in tables if table.startswith("[workspace"))
    return re.sub(r"^(#.*\n)*default-members = .*\n", "", kept, flags=re.MULTILINE)


def main() -> None:
    """Repacks the archive it is given."""
    path = sys.argv[1]
    epoch = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
    packed = io.BytesIO()
    with tarfile.open(path) as old, tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as new:
        for member in sorted(old.getmembers(), key=lambda m: m.name):
            file = old.extractfile(member)
            if file is None:
                continue
            content = file.read()
            if re.fullmatch(r"[^/]+/Cargo\.toml", member.name):
                content = inherited(content.decode()).encode()
            entry = tarfile.TarInfo(member.name)
            entry.size, entry.mtime, entry.mode = len(content), epoch, 0o644
            new.addfile(entry, io.BytesIO(content))
        # pyproject.toml names the folder, and an archive of files alone has no empty one.
        above = new.getnames()[0].split("/")[0]
        for folder in (f"{above}/strapd.data", f"{above}/strapd.data/scripts"):
            entry = tarfile.TarInfo(folder)
            entry.type, entry.mtime, entry.mode = tarfile.DIRTYPE, epoch, 0o755
            new.addfile(entry)
    with open(path, "wb") as out, gzip.GzipFile(fileobj=out, mode="wb", filename="", mtime=epoch, compresslevel=9) as zipped:
        zipped.write(packed.getvalue())


if __name__ == "__main__":
    main()
