"""numpy on wine 8: a small DLL in place of the C library's functions of complex numbers.

`complex_math.py FOLDER` writes xmath.dll, which hands everything else on to ucrtbase; numpy's modules then import that.
"""

import struct
import subprocess
import sys
from pathlib import Path

OWN = {
    "crealf": "float crealf_(unsigned long long z){union{unsigned u;float f;}x;x.u=(unsigned)z;return x.f;}",
    "cimagf": "float cimagf_(unsigned long long z){union{unsigned u;float f;}x;x.u=(unsigned)(z>>32);return x.f;}",
    "creal": "double creal_(double*z){return z[0];}",
    "cimag": "double cimag_(double*z){return z[1];}",
    "creall": "double creall_(double*z){return z[0];}",
    "cimagl": "double cimagl_(double*z){return z[1];}",
}
OLD, NEW = b"api-ms-win-crt-math-l1-1-0.dll", b"xmath.dll"


def take_imports(module: Path) -> list[str]:
    """Names that the module imports from the C library's mathematics; from now on it takes them from xmath.dll."""
    data = bytearray(module.read_bytes())
    header = struct.unpack_from("<I", data, 0x3C)[0]
    count, size = struct.unpack_from("<H", data, header + 6)[0], struct.unpack_from("<H", data, header + 20)[0]
    optional = header + 24
    sections = [struct.unpack_from("<8sIIII", data, optional + size + 40 * k) for k in range(count)]

    def place(address: int) -> int:
        for _, virtual, start, raw, offset in sections:
            if start <= address < start + max(virtual, raw):
                return address - start + offset
        raise ValueError(address)

    names: list[str] = []
    entry = place(struct.unpack_from("<I", data, optional + 112 + 8)[0])
    while True:
        table, _, _, name, other = struct.unpack_from("<5I", data, entry)
        if not name:
            break
        at = place(name)
        if bytes(data[at : data.index(0, at)]) == OLD:
            row = place(table or other)
            while value := struct.unpack_from("<Q", data, row)[0]:
                text = place(value) + 2
                names.append(bytes(data[text : data.index(0, text)]).decode())
                row += 8
            data[at : at + len(OLD)] = NEW.ljust(len(OLD), b"\0")
        entry += 20
    module.write_bytes(data)
    return names


folder = Path(sys.argv[1])
names = sorted({n for f in folder.glob("python/Lib/site-packages/numpy/**/*.pyd") for n in take_imports(f)})
if names:
    source, exports = folder / "xmath.c", folder / "xmath.def"
    bodies = "\n".join("__declspec(dllexport) " + body for body in OWN.values())
    source.write_text("int _fltused=0; int DllMainCRTStartup(void*a,unsigned b,void*c){return 1;}\n" + bodies + "\n")
    lines = (f"{n}={n}_" if n in OWN else f"{n}=ucrtbase.{n}" for n in names)
    exports.write_text("LIBRARY xmath.dll\nEXPORTS\n" + "\n".join(lines) + "\n")
    target = folder / "python" / "xmath.dll"
    command = [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu", "-shared", "-nostdlib", "-O1"]
    subprocess.run([*command, "-o", str(target), str(source), str(exports), "-Wl,-e,DllMainCRTStartup"], check=True)
