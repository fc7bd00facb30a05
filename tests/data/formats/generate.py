#!/usr/bin/env python3
"""Writes the files of this folder: one little scene in every format that is read, and what a reader must find in them.

    generate.py [FOLDER]            where to (the script's own folder)
    generate.py --seeds FOLDER      instead the smallest ones, for the fuzzers (tests/fuzz/corpus)

Python 3.8 and its standard library; the same bytes every time, but for what another zlib packs otherwise. The encoders are
written from the formats' documents and know nothing of the readers.
"""
import base64
import gzip
import heapq
import io
import json
import math
import os
import random
import struct
import sys
import zipfile
import zlib

COUNT = 260  # of the scene: two chunks of 256 in a compressed .ply
FEW = 24  # Gaussians of most files: the first ones of the scene
WITH_REST = 28  # the first ones have spherical harmonics
C0 = 0.28209479177387814
REST = {0: 0, 1: 3, 2: 8, 3: 15, 4: 24}  # coefficients per channel beyond the first, by degree


# ---------------------------------------------------------------------------------------------------------------- the scene
def f32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def short(value):
    """Few digits, so that expected.json stays small."""
    return f32(round(value, 3))


def make_scene():
    rng = random.Random(20261124)
    scene = []
    for index in range(COUNT):
        far = 20 if index == 7 else 2
        norm = rng.uniform(0.6, 1.9)  # trained files are not normalised
        rotation = [rng.gauss(0, 1) for _ in range(4)]
        length = math.sqrt(sum(c * c for c in rotation))
        scene.append({
            "position": [short(rng.uniform(-far, far)) for _ in range(3)],
            "log_scale": [short(rng.uniform(-6, -1)) for _ in range(3)],
            "rotation": [short(c / length * norm) for c in rotation],
            "opacity_logit": short({3: 9.0, 4: -9.0}.get(index, rng.uniform(-3.5, 3.5))),
            "f_dc": [short(rng.uniform(-1.7, 1.7)) for _ in range(3)],
            "f_rest": [[short(rng.uniform(-0.9, 0.9)) for _ in range(24)] for _ in range(3)] if index < WITH_REST else [],
        })
    return scene


def unit(rotation):
    length = math.sqrt(sum(c * c for c in rotation))
    return [c / length for c in rotation]


def opacity(g):
    return 1 / (1 + math.exp(-g["opacity_logit"]))


def colour(g):
    return [0.5 + C0 * c for c in g["f_dc"]]


def code(value, most):
    """The nearest whole number of 0 to `most`."""
    return max(0, min(most, int(math.floor(value + 0.5))))


def largest_left_out(q):
    """The index of the largest component, and the others in order, with the sign for which the largest is positive."""
    largest = max(range(4), key=lambda i: abs(q[i]))
    sign = -1 if q[largest] < 0 else 1
    return largest, [sign * q[i] for i in range(4) if i != largest]


# --------------------------------------------------------------------------------------------------------------- INRIA .ply
def inria_ply(gaussians, degree):
    k = REST[degree]
    names = ["x", "y", "z", "nx", "ny", "nz"] + ["f_dc_%d" % i for i in range(3)]
    names += ["f_rest_%d" % i for i in range(3 * k)] + ["opacity"]
    names += ["scale_%d" % i for i in range(3)] + ["rot_%d" % i for i in range(4)]
    header = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(gaussians)
    header += "".join("property float %s\n" % name for name in names) + "end_header\n"
    out = header.encode()
    for g in gaussians:
        values = g["position"] + [0, 0, 0] + g["f_dc"]
        for channel in range(3):
            values = values + g["f_rest"][channel][:k] if k else values
        values = values + [g["opacity_logit"]] + g["log_scale"] + g["rotation"]
        out += struct.pack("<%df" % len(values), *values)
    return out


# ----------------------------------------------------------------------------------------------------------- compressed .ply
def compressed_ply(gaussians, columns, degree):
    chunks = [gaussians[i:i + 256] for i in range(0, len(gaussians), 256)]
    k = REST[degree]
    header = "ply\nformat binary_little_endian 1.0\ncomment made by generate.py\nelement chunk %d\n" % len(chunks)
    for prefix, axes in (("", "xyz"), ("scale_", "xyz"), ("", "rgb"))[:columns // 6]:
        for end in ("min_", "max_"):
            header += "".join("property float %s%s%s\n" % (end, prefix, axis) for axis in axes)
    header += "element vertex %d\n" % len(gaussians)
    for name in ("position", "rotation", "scale", "color"):
        header += "property uint packed_%s\n" % name
    if k:
        header += "element sh %d\n" % len(gaussians)
        header += "".join("property uchar f_rest_%d\n" % i for i in range(3 * k))
    ranges, vertices, rest = b"", b"", b""
    for chunk in chunks:
        ends = []
        for values in (lambda g: g["position"], lambda g: g["log_scale"], colour):
            low = [f32(min(values(g)[i] for g in chunk)) for i in range(3)]
            high = [f32(max(values(g)[i] for g in chunk)) for i in range(3)]
            ends.append((low, high))
        for low, high in ends[:columns // 6]:
            ranges += struct.pack("<6f", *low, *high)
        if columns == 12:
            ends[2] = ([0, 0, 0], [1, 1, 1])
        for g in chunk:
            def share(values, which, i):
                low, high = ends[which][0][i], ends[which][1][i]
                return (values[i] - low) / (high - low)

            def packed(values, which):
                return (code(share(values, which, 0) * 2047, 2047) << 21 |
                        code(share(values, which, 1) * 1023, 1023) << 11 |
                        code(share(values, which, 2) * 2047, 2047))

            largest, others = largest_left_out(unit(g["rotation"]))
            rotation = largest << 30
            for shift, c in zip((20, 10, 0), others):
                rotation |= code((c / math.sqrt(2) + 0.5) * 1023, 1023) << shift
            shade = 0
            for shift, i in ((24, 0), (16, 1), (8, 2)):
                shade |= code(share(colour(g), 2, i) * 255, 255) << shift
            shade |= code(opacity(g) * 255, 255)
            vertices += struct.pack("<4I", packed(g["position"], 0), rotation, packed(g["log_scale"], 1), shade)
            for channel in range(3):
                for c in range(k):
                    rest += bytes([max(0, min(255, int((g["f_rest"][channel][c] / 8 + 0.5) * 256)))])
    return (header + "end_header\n").encode() + ranges + vertices + rest


# -------------------------------------------------------------------------------------------------------------------- .splat
def splat(gaussians):
    out = b""
    for g in gaussians:
        out += struct.pack("<6f", *g["position"], *[math.exp(s) for s in g["log_scale"]])
        out += bytes([code(255 * c, 255) for c in colour(g)] + [code(255 * opacity(g), 255)])
        out += bytes([code(128 + 128 * c, 255) for c in unit(g["rotation"])])
    return out


# ---------------------------------------------------------------------------------------------------------------------- .spz
# Half a turn around x: the signs of the spherical harmonics 1 to 15. Those of degree 4 are not read.
SPZ_SIGNS = [-1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1] + [1] * 9


def spz_blocks(gaussians, version, degree):
    positions, alphas, colours, scales, rotations, rest = b"", b"", b"", b"", b"", b""
    for g in gaussians:
        x, y, z = g["position"]
        for c in (x, -y, -z):
            positions += struct.pack("<e", c) if version == 1 else struct.pack("<i", int(math.floor(c * 4096 + 0.5)))[:3]
        alphas += bytes([code(255 * opacity(g), 255)])
        colours += bytes([code((c * 0.15 + 0.5) * 255, 255) for c in g["f_dc"]])
        scales += bytes([code((s + 10) * 16, 255) for s in g["log_scale"]])
        w, x, y, z = unit(g["rotation"])
        q = [x, -y, -z, w]
        if version <= 2:
            sign = -1 if w < 0 else 1
            rotations += bytes([code((sign * c + 1) * 127.5, 255) for c in q[:3]])
        else:
            largest, others = largest_left_out(q)
            word = largest
            for c in others:  # the first is the highest
                magnitude = code(abs(c) / math.sqrt(0.5) * 511, 511)
                word = word << 10 | (1 << 9 if c < 0 else 0) | magnitude
            rotations += struct.pack("<I", word)
        for c in range(REST[degree]):
            for channel in range(3):
                rest += bytes([code(SPZ_SIGNS[c] * g["f_rest"][channel][c] * 128 + 128, 255)])
    return [positions, alphas, colours, scales, rotations, rest]


def spz(gaussians, version, degree, extension=b""):
    flags = 2 if extension else 0
    return struct.pack("<4sIIBBBB", b"NGSP", version, len(gaussians), degree, 12, flags, 0) + b"".join(
        spz_blocks(gaussians, version, degree)) + extension


def zstd_frame(content):
    """A Zstandard frame of raw blocks, a run for the last one if it is of equal bytes."""
    header = b"\x28\xb5\x2f\xfd"
    if len(content) < 256:
        header += bytes([0x20, len(content)])
    else:
        header += b"\x60" + struct.pack("<H", len(content) - 256)
    parts = [content[i:i + 1000] for i in range(0, len(content), 1000)] or [b""]
    out = header
    for i, part in enumerate(parts):
        run = len(set(part)) == 1
        out += struct.pack("<I", (i + 1 == len(parts)) | (2 if run else 0) | len(part) << 3)[:3]
        out += part[:1] if run else part
    return out


def spz4(gaussians, degree, extension=b""):
    blocks = spz_blocks(gaussians, 4, degree)
    if degree == 0:
        blocks.pop()
    frames = [zstd_frame(block) for block in blocks]
    table = 32 + len(extension)
    header = struct.pack("<4sIIBBBBI12x", b"NGSP", 4, len(gaussians), degree, 12, 2 if extension else 0, len(blocks), table)
    return header + extension + b"".join(
        struct.pack("<QQ", len(frame), len(block)) for frame, block in zip(frames, blocks)) + b"".join(frames)


# ------------------------------------------------------------------------------------------------------------------- .ksplat
def ksplat(gaussians, level, degree, sections, rest_range=(0, 0)):
    """`sections`: for each how many full buckets of 8, the sizes of the partial ones, and how much room is left over."""
    rest_low, rest_high = rest_range if rest_range != (0, 0) else (-1.5, 1.5)
    headers, data, first, total = b"", b"", 0, 0
    for full, partial, spare in sections:
        sizes = [8] * full + partial
        count = sum(sizes)
        here, buckets, start = gaussians[first:first + count], [], 0
        for size in sizes:
            buckets.append(here[start:start + size])
            start += size
        ends = [[(min(g["position"][i] for g in b), max(g["position"][i] for g in b)) for i in range(3)] for b in buckets]
        block = f32(1.001 * max([0.001] + [high - low for bucket in ends for low, high in bucket])) if level else 0.0
        centres = [[f32((low + high) / 2) for low, high in bucket] for bucket in ends]
        quantum = 1 if level == 0 else 32767
        records = b""
        for bucket, centre in zip(buckets, centres):
            for g in bucket:
                number = "<f" if level == 0 else "<e"
                if level == 0:
                    records += struct.pack("<3f", *g["position"])
                else:
                    records += struct.pack("<3H", *[code((p - c) / (block / 2) * quantum + quantum, 2 * quantum + 1)
                                                    for p, c in zip(g["position"], centre)])
                for value in [math.exp(s) for s in g["log_scale"]] + unit(g["rotation"]):
                    records += struct.pack(number, value)
                records += bytes([code(255 * c, 255) for c in colour(g)] + [code(255 * opacity(g), 255)])
                for low, high in ((0, 3), (3, 8))[:degree]:
                    for channel in range(3):
                        for value in g["f_rest"][channel][low:high]:
                            if level == 2:
                                records += bytes([code((value - rest_low) / (rest_high - rest_low) * 255, 255)])
                            else:
                                records += struct.pack(number, value)
        stride = len(records) // count
        room = count + spare
        storage = b""
        if level:
            storage = b"".join(struct.pack("<I", size) for size in partial)
            storage += b"".join(struct.pack("<3f", *centre) for centre in centres)
        storage += records + bytes(spare * stride)
        headers += struct.pack("<4If H2xII IIH982x", count, room, 8 if level else 0, len(buckets) if level else 0, block,
                               12 if level else 0, quantum, len(storage), full if level else 0,
                               len(partial) if level else 0, degree)
        data += storage
        first += count
        total += count
    header = struct.pack("<BB2xIIIIH2x3fff", 0, 1, len(sections), len(sections), total, total, level, 0, 0, 0, *rest_range)
    return header + bytes(4096 - len(header)) + headers + data


# --------------------------------------------------------------------------------------------------------- WebP, literals alone
class Bits:
    def __init__(self):
        self.value, self.size = 0, 0

    def add(self, value, size):
        self.value |= value << self.size
        self.size += size

    def bytes(self):
        return self.value.to_bytes((self.size + 7) // 8, "little")


def code_lengths(counts):
    """Huffman: the length of each symbol's code, 0 for those that do not occur."""
    heap = [(n, i, [i]) for i, n in enumerate(counts) if n]
    lengths = [0] * len(counts)
    heapq.heapify(heap)
    while len(heap) > 1:
        a, b = heapq.heappop(heap), heapq.heappop(heap)
        for symbol in a[2] + b[2]:
            lengths[symbol] += 1
        heapq.heappush(heap, (a[0] + b[0], min(a[1], b[1]), a[2] + b[2]))
    return lengths


def codes(lengths):
    """Canonical codes as VP8L has them in its bits: (value, length) by symbol."""
    table, next_code = {}, 0
    for length in range(1, 16):
        for symbol, l in enumerate(lengths):
            if l == length:
                table[symbol] = (int(format(next_code, "0%db" % length)[::-1], 2), length)
                next_code += 1
        next_code <<= 1
    return table


def write_prefix_code(bits, counts):
    used = [symbol for symbol, n in enumerate(counts) if n] or [0]
    if len(used) <= 2:
        bits.add(1, 1)
        bits.add(len(used) - 1, 1)
        bits.add(1, 1)
        for symbol in used:
            bits.add(symbol, 8)
        return {used[0]: (0, 0)} if len(used) == 1 else {used[0]: (0, 1), used[1]: (1, 1)}
    lengths = code_lengths(counts)
    assert max(lengths) <= 15
    runs, i = [], 0
    while i < len(lengths):  # runs of zeros as 17 or 18
        end = i
        while end < len(lengths) and lengths[end] == 0 and end - i < 138:
            end += 1
        if end - i >= 11:
            runs.append((18, end - i - 11, 7))
        elif end - i >= 3:
            runs.append((17, end - i - 3, 3))
        else:
            end = i + 1
            runs.append((lengths[i], 0, 0))
        i = end
    order = [17, 18, 0, 1, 2, 3, 4, 5, 16, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]
    kinds = [0] * 19
    for kind, _, _ in runs:
        kinds[kind] += 1
    kind_lengths = code_lengths(kinds)
    if sum(1 for n in kinds if n) == 1:
        kind_lengths = [1 if n else 0 for n in kinds]
    assert max(kind_lengths) <= 7
    bits.add(0, 1)
    bits.add(19 - 4, 4)
    for kind in order:
        bits.add(kind_lengths[kind], 3)
    bits.add(0, 1)
    table = codes(kind_lengths)
    single = sum(1 for n in kinds if n) == 1
    for kind, extra, size in runs:
        if not single:
            bits.add(*table[kind])
        bits.add(extra, size)
    return codes(lengths)


def webp(pixels, width):
    """A lossless image of (red, green, blue, alpha), whole rows."""
    height = len(pixels) // width
    assert width * height == len(pixels)
    bits = Bits()
    bits.add(0x2F, 8)
    bits.add(width - 1, 14)
    bits.add(height - 1, 14)
    bits.add(any(p[3] != 255 for p in pixels), 1)
    bits.add(0, 3 + 1 + 1 + 1)  # version; neither transforms nor colour cache nor several codes
    tables = []
    for channel, alphabet in ((1, 280), (0, 256), (2, 256), (3, 256)):
        counts = [0] * alphabet
        for p in pixels:
            counts[p[channel]] += 1
        tables.append((channel, write_prefix_code(bits, counts)))
    write_prefix_code(bits, [0] * 40)  # distances
    for p in pixels:
        for channel, table in tables:
            bits.add(*table[p[channel]])
    data = bits.bytes()
    chunk = b"VP8L" + struct.pack("<I", len(data)) + data + bytes(len(data) % 2)
    return b"RIFF" + struct.pack("<I", len(chunk) + 4) + b"WEBP" + chunk


def constant_webp(width, height):
    """Any number of equal pixels in a few bytes: codes of one symbol take no bits."""
    small = webp([(7, 7, 7, 255)] * 4, 2)
    sides = (width - 1) | (height - 1) << 14
    word = struct.unpack("<I", small[21:25])[0]
    return small[:21] + struct.pack("<I", word & ~0xFFFFFFF | sides) + small[25:]


def png(pixels, width):
    """The same, with a gamma that is not to be applied."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + bytes(c for p in pixels[i:i + width] for c in p) for i in range(0, len(pixels), width))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, len(pixels) // width, 8, 6, 0, 0, 0)) + chunk(
        b"gAMA", struct.pack(">I", 100000)) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def image(pixels, encode=webp):
    width = math.ceil(math.sqrt(len(pixels)))
    height = math.ceil(len(pixels) / width)
    return encode(pixels + [(0, 0, 0, 255)] * (width * height - len(pixels)), width)


# ----------------------------------------------------------------------------------------------------------------------- SOG
def number(value):
    """As short as it may be for a float32."""
    for digits in range(1, 10):
        text = "%.*g" % (digits, value)
        if f32(float(text)) == f32(value):
            return json.loads(text)
    return value


def codebook(values):
    """256 values, and a function to codes of them: exact for up to 256 different ones, else equally far apart."""
    different = sorted(set(values))
    if len(different) <= 256:
        book = different + [0] * (256 - len(different))
    else:
        low, high = different[0], different[-1]
        book = [f32(low + (high - low) * i / 255) for i in range(256)]
    return [number(v) for v in book], lambda value: min(range(256), key=lambda i: abs(book[i] - value))


def sog(gaussians, version, degree, encode=webp):
    """{name: bytes} of meta.json and its images."""
    kind = "." + encode.__name__

    def pixels(image_of):
        return image(image_of, encode)

    def folded(value):
        return math.copysign(math.log(abs(value) + 1), value)

    def ends(values, channels):
        return ([f32(min(values(g)[i] for g in gaussians)) for i in range(channels)],
                [f32(max(values(g)[i] for g in gaussians)) for i in range(channels)])

    files, k = {}, REST[degree]
    low, high = ends(lambda g: [folded(c) for c in g["position"]], 3)
    means = [[code((folded(g["position"][i]) - low[i]) / (high[i] - low[i]) * 65535, 65535) for i in range(3)]
             for g in gaussians]
    files["means_l" + kind] = pixels([tuple(c & 255 for c in m) + (255,) for m in means])
    files["means_u" + kind] = pixels([tuple(c >> 8 for c in m) + (255,) for m in means])
    rotations = []
    for g in gaussians:
        largest, others = largest_left_out(unit(g["rotation"]))
        rotations.append(tuple(code((c * math.sqrt(2) + 1) / 2 * 255, 255) for c in others) + (252 + largest,))
    files["quats" + kind] = pixels(rotations)
    meta = {"means": {"mins": [number(c) for c in low], "maxs": [number(c) for c in high],
                      "files": ["means_l" + kind, "means_u" + kind]},
            "scales": {"files": ["scales" + kind]}, "quats": {"files": ["quats" + kind]}, "sh0": {"files": ["sh0" + kind]}}
    if version == 2:
        meta = dict({"version": 2, "count": len(gaussians), "antialias": False}, **meta)
        meta["scales"]["codebook"], scale_code = codebook([s for g in gaussians for s in g["log_scale"]])
        meta["sh0"]["codebook"], colour_code = codebook([c for g in gaussians for c in g["f_dc"]])
        scales = [tuple(scale_code(s) for s in g["log_scale"]) + (255,) for g in gaussians]
        colours = [tuple(colour_code(c) for c in g["f_dc"]) + (code(255 * opacity(g), 255),) for g in gaussians]
    else:
        def lerped(name, values, channels):
            low, high = ends(values, channels)
            meta[name].update({"mins": [number(c) for c in low], "maxs": [number(c) for c in high]})
            return [tuple(code((values(g)[i] - low[i]) / (high[i] - low[i]) * 255, 255) for i in range(channels))
                    for g in gaussians]
        for name, channels in (("means", 3), ("scales", 3), ("quats", 4), ("sh0", 4)):
            meta[name].update({"shape": [len(gaussians), channels], "dtype": "float32"})
        meta["quats"]["encoding"] = "quaternion_packed"
        scales = [s + (255,) for s in lerped("scales", lambda g: g["log_scale"], 3)]
        colours = lerped("sh0", lambda g: g["f_dc"] + [g["opacity_logit"]], 4)
    files["scales" + kind] = pixels(scales)
    files["sh0" + kind] = pixels(colours)
    if k:
        entries = 70  # more than a row; those that nobody names are grey
        place = [(37 * i + 5) % entries for i in range(len(gaussians))]
        values = [v for g in gaussians for channel in g["f_rest"] for v in channel[:k]]
        rest = {"files": ["shN_centroids" + kind, "shN_labels" + kind]}
        if version == 2:
            rest.update({"count": entries, "bands": degree})
            rest["codebook"], rest_code = codebook(values)
        else:
            low, high = f32(min(values)), f32(max(values))
            rest.update({"shape": [len(gaussians), 3 * k], "dtype": "float32", "mins": number(low), "maxs": number(high),
                         "quantization": 8})
            def rest_code(value):
                return code((value - low) / (high - low) * 255, 255)
        centroids = [(128, 128, 128, 255)] * (64 * k * 2)
        for g, p in zip(gaussians, place):
            for j in range(k):
                centroids[p // 64 * 64 * k + p % 64 * k + j] = tuple(rest_code(g["f_rest"][i][j]) for i in range(3)) + (255,)
        files["shN_centroids" + kind] = encode(centroids, 64 * k)
        files["shN_labels" + kind] = pixels([(p & 255, p >> 8, 0, 255) for p in place])
        meta["shN"] = rest
    files["meta.json"] = json.dumps(meta, separators=(",", ":")).encode()
    return files


def zipped(files, prefix="", method=zipfile.ZIP_STORED):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(prefix + name, (2026, 11, 24, 0, 0, 0))
            entry.compress_type = method
            entry.create_system = 3
            archive.writestr(entry, files[name])
    return out.getvalue()


def streamed_sog(scene, degree=1):
    """Three levels in three files, and what lies around; {name: bytes}, and the indices of each level in order."""
    parts = {"L_0/": scene[0:16], "L_0b/": scene[16:24], "L_1/": scene[0:13], "environment/": scene[24:28]}
    files = {}
    for folder, gaussians in parts.items():
        for name, content in sog(gaussians, 2, degree).items():
            files[folder + name] = content
    bound = {"min": [-21, -21, -21], "max": [21, 21, 21]}
    def leaf(**lods):
        return {"bound": bound, "lods": {level[1:]: dict(zip(("file", "offset", "count"), run)) for level, run in lods.items()}}
    meta = {
        "lodLevels": 3, "environment": "environment/meta.json",
        "filenames": ["L_0/meta.json", "L_0b/meta.json", "L_1/meta.json"],
        "tree": {"bound": bound, "children": [
            leaf(_0=(1, 0, 8), _1=(2, 6, 4)),
            {"bound": bound, "children": [leaf(_0=(0, 10, 6), _1=(2, 0, 6), _2=(2, 10, 1)),
                                          leaf(_0=(0, 0, 10), _2=(2, 11, 2))]}]}}
    files["lod-meta.json"] = json.dumps(meta, separators=(",", ":")).encode()
    around = list(range(24, 28))
    orders = [list(range(16, 24)) + list(range(10, 16)) + list(range(0, 10)) + around,
              list(range(6, 10)) + list(range(0, 6)) + around, [10, 11, 12] + around]
    return files, orders


# ---------------------------------------------------------------------------------------------------------------------- glTF
def gltf(gaussians, degree, logarithms=False, **node):
    """The document of KHR_gaussian_splatting, and its buffer; `node`: how its one node places it."""
    attributes, accessors, views, buffer = {}, [], [], b""

    def add(name, values):
        nonlocal buffer
        shape = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[len(values[0])]
        data = b"".join(struct.pack("<%df" % len(v), *v) for v in values)
        attributes[name] = len(accessors)
        accessors.append({"bufferView": len(views), "componentType": 5126, "count": len(values), "type": shape})
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(data)})
        buffer += data

    khr = "KHR_gaussian_splatting:"
    add("POSITION", [g["position"] for g in gaussians])
    add(khr + "ROTATION", [g["rotation"][1:] + g["rotation"][:1] for g in gaussians])
    add(khr + "SCALE", [g["log_scale"] if logarithms else [math.exp(s) for s in g["log_scale"]] for g in gaussians])
    add(khr + "OPACITY", [[opacity(g)] for g in gaussians])
    add(khr + "SH_DEGREE_0_COEF_0", [g["f_dc"] for g in gaussians])
    for c in range(REST[degree]):
        band = int(math.sqrt(c + 1))
        add(khr + "SH_DEGREE_%d_COEF_%d" % (band, c + 1 - band * band),
            [[g["f_rest"][channel][c] for channel in range(3)] for g in gaussians])
    extension = {"kernel": "ellipse", "colorSpace": "srgb_rec709_display", "projection": "perspective", "sortingMethod": "zDepth"}
    document = {
        "asset": {"version": "2.0"}, "extensionsUsed": ["KHR_gaussian_splatting"], "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [dict(mesh=0, **node)],
        "meshes": [{"primitives": [{"mode": 0, "attributes": attributes, "extensions": {"KHR_gaussian_splatting": extension}}]}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(buffer)}]}
    return document, buffer


def glb(document, buffer):
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def gltf_text(document, uri):
    return json.dumps(dict(document, buffers=[dict(document["buffers"][0], uri=uri)]), separators=(",", ":")).encode()


# ---------------------------------------------------------------------------------------------------------------------- all
def bundle(files, first):
    """Several files as one, as tests/fuzz/exercise.h has it."""
    names = [first] + sorted(name for name in files if name != first)
    return b"\n".join(b"==> " + name.encode() + b"\n" + files[name] for name in names)


def write_seeds(folder):
    scene = make_scene()
    three = scene[:3]
    extension = struct.pack("<II", 0x11223344, 4) + b"none"
    streamed = streamed_sog(scene, 0)[0]
    seeds = {
        "inria_ply": {"sh0": inria_ply(three, 0), "sh1": inria_ply(three, 1), "sh3": inria_ply(three, 3),
                      "anti_aliased": inria_ply(three, 0).replace(b"element", b"comment SplatRenderMode: mip\nelement", 1),
                      "z_up": inria_ply(three, 0).replace(b"element", b"comment Vertical Axis: z\nelement", 1)},
        "compressed_ply": {"12_columns": compressed_ply(three, 12, 0), "18_columns": compressed_ply(three, 18, 0),
                           "sh1": compressed_ply(three, 18, 1)},
        "splat": {"three": splat(three)},
        "spz": {"v1": gzip.compress(spz(three, 1, 1), 9, mtime=0), "v4_axes": spz4(three, 3, struct.pack("<III", 0xADBE0003, 4, 12)),
                "v3_axes": gzip.compress(spz(three, 3, 1, struct.pack("<III", 0xADBE0003, 4, 6)), 9, mtime=0),
                "v2": gzip.compress(spz(three, 2, 1), 9, mtime=0), "v2_bare": spz(three, 2, 0),
                "v3_bare": spz(three, 3, 3), "v4": spz4(three, 0), "v4_sh4": spz4(three, 4, extension)},
        "ksplat": {"level0": ksplat(three, 0, 0, [(0, [3], 0)]), "level1": ksplat(three, 1, 1, [(0, [2, 1], 0)]),
                   "level2": ksplat(scene[:10], 2, 2, [(1, [1], 1), (0, [1], 0)])},
        "sog": {"v1": bundle(sog(three, 1, 0), "meta.json"), "v1_sh1": bundle(sog(three, 1, 1), "meta.json"),
                "v2": bundle(sog(three, 2, 0), "meta.json"), "v2_sh2": bundle(sog(three, 2, 2), "meta.json"),
                "v2_png": bundle(sog(three, 2, 1, png), "meta.json"),
                "v1_zip": zipped(sog(three, 1, 0), "", zipfile.ZIP_DEFLATED), "v2_zip": zipped(sog(three, 2, 1))},
        "gltf": {"glb": glb(*gltf(three, 1)), "logarithms": glb(*gltf(three, 0, True)),
                 "turned": glb(*gltf(three, 3, rotation=[0.5, 0.5, 0.5, 0.5], scale=[2, 2, 2], translation=[1000, 0, 3])),
                 "embedded": gltf_text(gltf(three, 0)[0], "data:application/octet-stream;base64," + base64.b64encode(
                     gltf(three, 0)[1]).decode())},
        "streamed_sog": {"lod0": bundle(streamed, "lod-meta.json") + b"\0", "lod1": bundle(streamed, "lod-meta.json") + b"\1"}}
    # Attacks; tests/formats/hostile_test.cpp says what is expected of each.
    bomb = struct.pack("<4sIIBBBB", b"NGSP", 3, 3, 0, 12, 0, 0) + b"".join(spz_blocks(three, 3, 0)) + bytes(17 << 20)
    seeds["spz"]["bomb"] = gzip.compress(bomb, 9, mtime=0)
    seeds["spz"]["v4_announces_exabytes"] = spz4(three, 0).replace(
        zstd_frame(spz_blocks(three, 4, 0)[0]), b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", 1 << 60) + bytes(20))
    files = sog(three, 2, 0)
    seeds["sog"]["webp_bomb"] = bundle(dict(files, **{"means_l.webp": constant_webp(16383, 16383)}), "meta.json")
    seeds["sog"]["constant_images"] = bundle(
        dict({name: constant_webp(256, 256) for name in files}, **{
            "meta.json": files["meta.json"].replace(b'"count":3', b'"count":65536')}), "meta.json")
    seeds["sog"]["zip_bomb"] = zipped(dict(files, **{"means_l.webp": bytes(8 << 20)}), "", zipfile.ZIP_DEFLATED)
    seeds["sog"]["zip_lzma"] = zipped(files, "", zipfile.ZIP_LZMA)
    archive = zipped(files)
    entry = archive.rindex(b"PK\1\2", 0, archive.rindex(b"means_l.webp"))
    seeds["sog"]["zip_announces_gigabytes"] = archive[:entry + 24] + b"\xfe\xff\xff\xff" + archive[entry + 28:]
    for name, files in seeds.items():
        os.makedirs(os.path.join(folder, name), exist_ok=True)
        for file, content in files.items():
            with open(os.path.join(folder, name, file), "wb") as out:
                out.write(content)


def main():
    if sys.argv[1:2] == ["--seeds"]:
        write_seeds(sys.argv[2])
        return
    folder = sys.argv[1] if len(sys.argv) > 1 else os.path.dirname(os.path.abspath(__file__))
    scene = make_scene()
    few = scene[:FEW]
    expected = []

    def write(name, content):
        path = os.path.join(folder, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(content)

    byte = 0.5 / 255  # half a code
    exact = {"position": 0, "log_scale": 0, "rotation": 1e-6, "opacity": 1e-6, "f_dc": 0, "f_rest": 0}

    def expect(name, format, degree, tolerance, indices=None):
        """`tolerance`: what the format's quanta allow; of `rotation` a component of the unit quaternion."""
        expected.append({"file": name, "format": format, "sh_degree": degree,
                         "indices": indices if indices is not None else list(range(FEW)),
                         "tolerance": {key: number(float(value) * 1.001) for key, value in dict(exact, **tolerance).items()}})

    def span(values, gaussians):
        return max(max(values(g)[i] for g in gaussians) - min(values(g)[i] for g in gaussians) for i in range(3))

    for degree in range(4):
        name, gaussians = "sh%d.ply" % degree, scene if degree == 0 else few
        write(name, inria_ply(gaussians, degree))
        expect(name, "INRIA .ply", degree, {}, list(range(len(gaussians))))

    for name, columns, degree in (("12_columns", 12, 0), ("18_columns", 18, 0), ("sh1", 18, 1), ("sh2", 12, 2), ("sh3", 18, 3)):
        gaussians = scene if degree == 0 else few
        name += ".compressed.ply"
        write(name, compressed_ply(gaussians, columns, degree))
        shade = 1 if columns == 12 else span(colour, gaussians)
        expect(name, "PlayCanvas compressed .ply", degree,
               {"position": span(lambda g: g["position"], gaussians) / 1023 / 2 + 1e-6,
                "log_scale": span(lambda g: g["log_scale"], gaussians) / 1023 / 2 + 1e-6, "rotation": 0.0015,
                "opacity": byte, "f_dc": shade / 255 / 2 / C0 + 1e-6, "f_rest": 8 / 256 / 2}, list(range(len(gaussians))))

    write("small.splat", splat(few))
    expect("small.splat", "antimatter15 .splat", 0, {"log_scale": 2e-6, "rotation": 0.012, "opacity": byte,
                                                     "f_dc": byte / C0})

    coarse = {"position": 0.5 / 4096, "log_scale": 0.5 / 16, "opacity": byte, "f_dc": byte / 0.15, "f_rest": 0.5 / 128}
    for name, content, degree, rotation in (
            ("v1.spz", gzip.compress(spz(few, 1, 0), 9, mtime=0), 0, 0.1),
            ("v2_sh1.spz", gzip.compress(spz(few, 2, 1), 9, mtime=0), 1, 0.1),
            ("v2_bare.spz", spz(few, 2, 0), 0, 0.1),
            ("v3.spz", gzip.compress(spz(few, 3, 0), 9, mtime=0), 0, 0.003),
            ("v3_sh2.spz", gzip.compress(spz(few, 3, 2), 9, mtime=0), 2, 0.003),
            ("v3_bare_sh3.spz", spz(few, 3, 3), 3, 0.003),
            ("v4.spz", spz4(few, 0), 0, 0.003),
            ("v4_sh3.spz", spz4(few, 3, struct.pack("<II", 0x11223344, 4) + b"none"), 3, 0.003),
            ("v4_sh4.spz", spz4(few, 4), 3, 0.003)):
        write(name, content)
        expect(name, "Niantic .spz", degree, dict(coarse, rotation=rotation, position=20 / 2 ** 12 if name == "v1.spz" else 0.5 / 4096))

    one, two = [(2, [5, 3], 0)], [(1, [5, 3], 2), (0, [8], 0)]
    for level in range(3):
        for degree in range(3):
            name = "level%d_sh%d.ksplat" % (level, degree)
            sections = two if degree == 2 else one
            rest_range = (-1.25, 1.25) if degree == 1 else (0, 0)
            write(name, ksplat(few, level, degree, sections, rest_range))
            tolerance = {"log_scale": 2e-6, "opacity": byte, "f_dc": byte / C0}
            if level > 0:  # half floats, and positions in 65536 parts of a block
                half = 2.0 ** -11
                tolerance.update({"position": 41 / 65534 / 2 + 1e-6, "log_scale": 2 * half, "rotation": 2 * half, "f_rest": half})
            if level == 2:
                tolerance["f_rest"] = 3 / 255 / 2
            expect(name, "mkkellogg .ksplat", degree, tolerance)

    def sog_tolerance(version, gaussians, degree):
        def folded(g):
            return [math.copysign(math.log(abs(c) + 1), c) for c in g["position"]]
        most = max(abs(c) for g in gaussians for c in g["position"])
        tolerance = {"position": (1 + most) * span(folded, gaussians) / 65535 / 2 + 1e-5, "rotation": 0.006,
                     "opacity": byte, "f_rest": 1.8 / 255 / 2 if version == 1 or degree > 1 else 0}
        if version == 1:
            logit = [g["opacity_logit"] for g in gaussians]
            tolerance.update({"log_scale": span(lambda g: g["log_scale"], gaussians) / 255 / 2 + 1e-6,
                              "f_dc": span(lambda g: g["f_dc"], gaussians) / 255 / 2 + 1e-6,
                              "opacity": (max(logit) - min(logit)) / 255 / 2 / 4})
        return tolerance

    for name, version, degree, prefix, method in (
            ("v1.sog", 1, 0, "", zipfile.ZIP_DEFLATED), ("v1_sh2.sog", 1, 2, "", zipfile.ZIP_STORED),
            ("v2.sog", 2, 0, "", zipfile.ZIP_STORED), ("v2_sh1.sog", 2, 1, "", zipfile.ZIP_STORED),
            ("v2_sh3.sog", 2, 3, "scene/", zipfile.ZIP_DEFLATED)):
        write(name, zipped(sog(few, version, degree), prefix, method))
        expect(name, "PlayCanvas SOG", degree, sog_tolerance(version, few, degree))
    for name, content in sog(few, 2, 2).items():
        write("sog/" + name, content)
    expect("sog", "PlayCanvas SOG", 2, sog_tolerance(2, few, 2))

    for name, content in sog(few, 2, 1, png).items():
        write("sog_png/" + name, content)
    expect("sog_png", "PlayCanvas SOG", 1, sog_tolerance(2, few, 1))

    linear = {"log_scale": 1e-6, "rotation": 1e-6, "opacity": 1e-6}
    document, buffer = gltf(few, 3)
    write("linear_sh3.glb", glb(document, buffer))
    expect("linear_sh3.glb", "glTF KHR_gaussian_splatting", 3, linear)
    write("logarithms.glb", glb(*gltf(few, 0, True)))
    expect("logarithms.glb", "glTF KHR_gaussian_splatting", 0, dict(linear, log_scale=0))
    document, buffer = gltf(few, 1)
    write("apart/buffer 1.bin", buffer)
    write("apart/scene.gltf", gltf_text(document, "buffer%201.bin"))
    expect("apart/scene.gltf", "glTF KHR_gaussian_splatting", 1, linear)
    write("embedded.gltf", gltf_text(document, "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()))
    expect("embedded.gltf", "glTF KHR_gaussian_splatting", 1, linear)

    files, orders = streamed_sog(scene)
    for name, content in files.items():
        write("streamed/" + name, content)
    for level, order in enumerate(orders):
        expect("streamed#lod=%d" % level, "PlayCanvas streamed SOG", 1, sog_tolerance(2, scene[:28], 1), order)

    def line(value):
        return json.dumps(value, separators=(",", ":"))

    def rounded(value):
        return [rounded(v) for v in value] if isinstance(value, list) else number(value)

    lines = ['{"gaussians":[']
    for i, g in enumerate(scene):
        plain = {key: rounded(value) for key, value in g.items()}
        plain["f_rest"] = [channel[:15] for channel in plain["f_rest"]]
        lines.append(line(plain) + ("," if i + 1 < COUNT else ""))
    lines.append('],"files":[')
    lines += [line(entry) + ("," if i + 1 < len(expected) else "") for i, entry in enumerate(expected)]
    lines.append("]}")
    write("expected.json", ("\n".join(lines) + "\n").encode())


if __name__ == "__main__":
    main()
