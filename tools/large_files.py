#!/usr/bin/env python3
"""Memory and time of `whirl info` and `whirl convert` on files larger than memory: the table of docs/reliability.md.

Usage: large_files.py BUILD FOLDER FORMAT holes|numbers   FORMAT: tdms mat hdf5 mat73 wav npy npz

Makes one file in FOLDER, 20 GB of holes or 2 GB of random numbers in four channels, prints one line per call, removes it.
"""
import ctypes
import os
import pathlib
import struct
import subprocess
import sys

import numpy as np

CHANNELS = 4
NAMES = {"tdms": "x.tdms", "mat": "x.mat", "hdf5": "x.h5", "mat73": "x73.mat", "wav": "x.wav", "npy": "x_m.npy", "npz": "x.npz"}
FLAGS = {"npy": ["--rate", "10000"], "npz": ["--rate", "10000"], "wav": ["--columns", "1:a_m", "2:b_m", "3:c_m", "4:d_m"]}


def fill(file, count, code, real):
    """So many numbers: random ones, or a hole."""
    if not real:
        file.seek(count * np.dtype(code).itemsize, os.SEEK_CUR)
        file.truncate(file.tell())
        return
    block = np.random.default_rng(1).normal(size=1 << 20).astype(code).tobytes()
    left = count * np.dtype(code).itemsize
    while left > 0:
        left -= file.write(block[:left])


def tdms(file, rows, real):
    def text(s):
        return struct.pack("<I", len(s)) + s.encode()
    chunk = 1000
    meta = struct.pack("<I", CHANNELS)
    for c in range(CHANNELS):
        meta += text(f"/'g'/'x{c}'") + struct.pack("<IIIQI", 20, 10, 1, chunk, 2) + text("wf_increment")
        meta += struct.pack("<Id", 10, 1e-4) + text("unit_string") + struct.pack("<I", 0x20) + text("m")
    values = rows // chunk * chunk * CHANNELS
    file.write(b"TDSm" + struct.pack("<IIQQ", 14, 4713, len(meta) + 8 * values, len(meta)) + meta)
    fill(file, values, "<f8", real)


def wav(file, rows, real):
    data = 2 * rows * 4 * CHANNELS
    file.write(b"RF64" + struct.pack("<I", 0xFFFFFFFF) + b"WAVEds64" + struct.pack("<IQQQI", 28, data + 72, data, 2 * rows, 0))
    file.write(b"fmt " + struct.pack("<IHHIIHH", 16, 3, CHANNELS, 10000, 40000 * CHANNELS, 4 * CHANNELS, 32))
    file.write(b"data" + struct.pack("<I", 0xFFFFFFFF))
    fill(file, 2 * rows * CHANNELS, "<f4", real)


def npy_head(shape):
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    head += b" " * (63 - (10 + len(head)) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head


def npy(file, rows, real):
    file.write(npy_head((rows, CHANNELS)))
    fill(file, rows * CHANNELS, "<f8", real)


def npz(file, rows, real):
    """Stored members with the sizes of ZIP64."""
    directory, wide = b"", 0xFFFFFFFF
    for c in range(CHANNELS):
        name, head, at = f"x{c}_m.npy".encode(), npy_head((rows,)), file.tell()
        size = len(head) + 8 * rows
        extra = struct.pack("<HHQQ", 1, 16, size, size)
        file.write(b"PK\x03\x04" + struct.pack("<HHHHHIIIHH", 45, 0, 0, 0, 0x21, 0, wide, wide, len(name), len(extra)))
        file.write(name + extra + head)
        fill(file, rows, "<f8", real)
        extra = struct.pack("<HHQQQ", 1, 24, size, size, at)
        directory += b"PK\x01\x02" + struct.pack("<HHHHHHIIIHHHHHII", 45, 45, 0, 0, 0, 0x21, 0, wide, wide, len(name),
                                                 len(extra), 0, 0, 0, 0, wide) + name + extra
    at = file.tell()
    file.write(directory + b"PK\x06\x06" + struct.pack("<QHHIIQQQQ", 44, 45, 45, 0, 0, CHANNELS, CHANNELS, len(directory), at))
    file.write(b"PK\x06\x07" + struct.pack("<IQI", 0, at + len(directory), 1))
    file.write(b"PK\x05\x06" + struct.pack("<HHHHIIH", 0, 0, CHANNELS, CHANNELS, len(directory), wide, 0))


def mat(file, rows, real):
    """A variable of version 5 is below 4 GiB: more of them."""
    def element(kind, data):
        return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)

    def variable(name, count):
        head = element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<ii", count, 1)) + element(1, name.encode())
        file.write(struct.pack("<II", 14, len(head) + 8 + 8 * count) + head + struct.pack("<II", 9, 8 * count))
    file.write(b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM")
    variable("fs", 1)
    file.write(struct.pack("<d", 1e4))
    count = CHANNELS if real else 10
    for c in range(count):
        variable(f"x{c}_m", rows * CHANNELS // count)
        fill(file, rows * CHANNELS // count, "<f8", real)


def hdf5(path, rows, real, matlab):
    """By the library, the values as one block for each channel."""
    lib, ident = ctypes.CDLL("libhdf5_serial.so.103"), ctypes.c_int64
    for name in ("H5Pcreate", "H5Fcreate", "H5Screate", "H5Screate_simple", "H5Dcreate2", "H5Acreate2"):
        getattr(lib, name).restype = ident
    lib.H5Dget_offset.restype = ctypes.c_uint64
    lib.H5open()

    def known(name):
        return ident(ident.in_dll(lib, name).value)
    double, size, step, nothing = known("H5T_IEEE_F64LE_g"), ctypes.c_uint64(rows), ctypes.c_double(1e-4), ident(0)
    created, plain = ident(lib.H5Pcreate(known("H5P_CLS_FILE_CREATE_ID_g"))), ident(lib.H5Pcreate(known("H5P_CLS_DATASET_CREATE_ID_g")))
    if matlab:
        lib.H5Pset_userblock(created, ctypes.c_uint64(512))
    lib.H5Pset_alloc_time(plain, 1)  # early
    lib.H5Pset_fill_time(plain, 1)  # never
    file = ident(lib.H5Fcreate(str(path).encode(), 2, created, nothing))
    space, one, places = ident(lib.H5Screate_simple(1, ctypes.byref(size), None)), ident(lib.H5Screate(0)), []
    for c in range(CHANNELS):
        data = ident(lib.H5Dcreate2(file, f"x{c}_m".encode(), double, space, nothing, plain, nothing))
        attribute = ident(lib.H5Acreate2(data, b"dt", double, one, nothing, nothing))
        lib.H5Awrite(attribute, known("H5T_NATIVE_DOUBLE_g"), ctypes.byref(step))
        lib.H5Aclose(attribute)
        places.append(lib.H5Dget_offset(data))
        lib.H5Dclose(data)
    lib.H5Fclose(file)
    with open(path, "r+b") as out:
        if matlab:
            out.write(b"MATLAB 7.3 MAT-file")
        for place in places if real else []:
            out.seek(place)
            fill(out, rows, "<f8", True)


def call(program, words, folder):
    child = subprocess.Popen([program, *words], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = child.stderr.read().decode()
    _, status, used = os.wait4(child.pid, 0)
    seconds = used.ru_utime + used.ru_stime
    print(f"{' '.join(words):<70} exit {os.waitstatus_to_exitcode(status)}  {used.ru_maxrss / 1000:.0f} MB  {seconds:.0f} s of processor time"
          + (f"  {said.splitlines()[-1]}" if status else ""), flush=True)


def main():
    build, folder, kind, what = sys.argv[1:]
    folder, real = pathlib.Path(folder), what == "numbers"
    path, rows = folder / NAMES[kind], (2 if real else 20) * 10**9 // (8 * CHANNELS)
    try:
        if kind in ("hdf5", "mat73"):
            hdf5(path, rows, real, kind == "mat73")
        else:
            with open(path, "wb") as file:
                {"tdms": tdms, "wav": wav, "npy": npy, "npz": npz, "mat": mat}[kind](file, rows, real)
        program, flags = str(pathlib.Path(build).resolve() / "bin/whirl"), FLAGS.get(kind, [])
        call(program, ["info", path.name], folder)
        call(program, ["convert", path.name, "some.csv", "--rows", "40000000:41000000", *flags], folder)
        if real:
            call(program, ["convert", path.name, "all.csv", *flags], folder)
        call(program, ["convert", path.name, "all.h5", *flags], folder)
    finally:
        for name in (path.name, "some.csv", "all.csv", "all.h5"):
            (folder / name).unlink(missing_ok=True)


main()
