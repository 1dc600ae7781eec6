"""A folder -> a ZIP on standard output, the same bytes for the same files: `zip.py FOLDER_ABOVE NAME SECONDS_SINCE_1970`."""
import io
import pathlib
import sys
import time
import zipfile

above, name, epoch = sys.argv[1:]
stamp = time.gmtime(int(epoch))[:6]
above = pathlib.Path(above)
archive = io.BytesIO()
with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as packed:
    for path in sorted(p for p in (above / name).rglob("*") if p.is_file()):
        entry = zipfile.ZipInfo(path.relative_to(above).as_posix(), stamp)
        entry.create_system = 3
        entry.compress_type = zipfile.ZIP_DEFLATED
        entry.external_attr = (0o100755 if path.suffix == ".exe" else 0o100644) << 16
        packed.writestr(entry, path.read_bytes())
sys.stdout.buffer.write(archive.getvalue())
