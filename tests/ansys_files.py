"""Small files in ANSYS's formats, written from what the formats say, to test the readers without ANSYS."""

import numpy as np

INTEGER, HALF, ZLIB, WINDOWS, BITS = 1 << 31, 1 << 30, 1 << 29, 1 << 28, 1 << 27


def record(numbers, *, packed=""):
    """Return the bytes of one record: integers or doubles, plain, or packed in "windows" or "bits"."""
    numbers = np.asarray(numbers)
    kind = np.dtype("<i4") if numbers.dtype.kind in "iu" else np.dtype("<f8")
    flags = INTEGER if kind.itemsize == 4 else 0
    if packed == "windows":
        content, flags = windows(numbers.astype(kind)), flags | WINDOWS
    elif packed == "bits":
        stored = numbers != 0
        code = sum(1 << int(i) for i in np.flatnonzero(stored))
        head = np.array([len(numbers), code], dtype=np.int64).astype("<u4").tobytes()
        content, flags = head + numbers[stored].astype(kind).tobytes(), flags | BITS
    else:
        content = numbers.astype(kind).tobytes()
    length = len(content) // 4
    return np.array([length, flags], "<u4").tobytes() + content + np.array([length], "<u4").tobytes()


def windows(numbers):
    """Return the content of a record packed in windows: runs of zeros are left out, runs of one value are one value."""
    pieces, at, n = [], 0, len(numbers)
    while at < n:
        if numbers[at] == 0:
            at += 1
            continue
        end = at
        while end < n and numbers[end] != 0:
            end += 1
        run = numbers[at:end]
        if len(run) == 1 and at > 0:
            pieces.append((np.array([at], "<i4").tobytes(), run.tobytes()))
        elif len(run) > 1 and (run == run[0]).all():
            pieces.append((np.array([-at, -len(run)], "<i4").tobytes(), run[:1].tobytes()))
        else:
            pieces.append((np.array([-at, len(run)], "<i4").tobytes(), run.tobytes()))
        at = end
    head = np.array([n, len(pieces)], "<i4").tobytes()
    return head + b"".join(place + values for place, values in pieces)


def full_file(mass, stiffness, nodes, *, held=(), damping=None, kinds=(1, 2, 3), header=None, packed=""):
    """Return the bytes of a ``.full`` file.

    Matrices are dense (n, n), equations node by node; `held` equations have a negative flag; `header` overrides items.
    """
    n = len(mass)
    head = np.zeros(160, dtype=np.int64)
    head[[0, 1, 3, 7, 32]] = -4, n, 2, len(kinds), len(nodes)
    front = record(np.array([4, *[0] * 99]))
    words = len(front) // 4 + len(record(head)) // 4
    body = record(np.array(kinds)) + record(np.array(nodes), packed=packed)

    def place(item, content):
        nonlocal body
        head[item] = words + len(body) // 4
        body += content

    def matrix(dense):
        rows, terms = b"", 0
        for i in range(n):
            columns = np.flatnonzero(dense[i, i:]) + i
            rows += record(columns + 1, packed=packed) + record(dense[i, columns].astype(float))
            terms += len(columns)
        return rows, terms

    for dense, pointer, low in ((stiffness, 18, 8), (mass, 26, 33), (damping, 28, 34)):
        if dense is not None:
            content, head[low] = matrix(dense)
            place(pointer, content)
    flags = np.zeros(n, dtype=np.int64)
    flags[list(held)] = -1
    place(35, record(np.full(len(nodes), len(kinds))) + record(flags, packed=packed))
    head[22] = words + len(body) // 4
    for item, value in (header or {}).items():
        head[item] = value
    return front + record(head) + body


def result_file(frequencies, shapes, nodes, *, angles=None, harmonic=None, sectors=0, header=None):
    """Return the bytes of a ``.rst`` file of a modal analysis.

    `nodes` is number -> (x, y, z); shapes (modes, nodes, 3) in nodal axes, nodes in the order of `nodes`.
    """
    k, n = len(frequencies), len(nodes)
    head = np.zeros(80, dtype=np.int64)
    head[[0, 2, 3, 4, 7, 8, 20, 48]] = 12, n, max(k, 4), 3, 2, k, sectors, n
    room = int(head[3])
    front = record(np.array([12, *[0] * 99]))
    words = len(front) // 4 + len(record(head)) // 4
    body = b""

    def place(item, content):
        nonlocal body
        head[item] = words + len(body) // 4
        body += content

    angles = np.zeros((n, 3)) if angles is None else angles
    place(14, record(np.array(list(nodes))))
    geometry = np.zeros(80, dtype=np.int64)
    geometry[3] = n
    geometry[26] = words + len(body) // 4 + len(record(geometry)) // 4
    located = [record(np.array([m, *p, *a], dtype=float)) for (m, p), a in zip(nodes.items(), angles, strict=True)]
    place(15, record(geometry) + b"".join(located))
    place(11, record(np.array([*frequencies, *[0.0] * (room - k)])))
    if harmonic is not None:
        place(16, record(np.array([*harmonic, *[0] * (room - k)])))
    pointers = np.zeros(2 * room, dtype=np.int64)
    for i, shape in enumerate(shapes):
        pointers[i] = words + len(body) // 4
        solution = np.zeros(200, dtype=np.int64)
        solution[[2, 19, 20, 21, 22]] = n, 3, 1, 2, 3
        solution[104] = len(record(solution)) // 4
        body += record(solution) + record(np.asarray(shape, dtype=float).ravel())
    place(10, record(pointers))
    for item, value in (header or {}).items():
        head[item] = value
    return front + record(head) + body
