"""From the contacts of one engine step to their impulses: groups, how bodies answer, and the integration of each."""

from __future__ import annotations

from contactlaw.jit import jit
from contactlaw.kernels.rest import BUSY, RESTING, how_quiet, is_still, settle, stay
from contactlaw.kernels.rows import CLOSED, EARLY, FRAME, IMPULSE, MOTION, OVERLAP_NOW
from contactlaw.kernels.subcycle import accelerate, parameters_of, resume, subcycle
from contactlaw.kernels.workspace import numbers, table, wholes, zero_table


@jit
def couple(rows, histories, parameters, trees, pulls, answers, dt, work_io):
    """Integrate all contacts over an engine step of dt [s], those that share a body together.

    rows, histories: one for each contact, see `kernels.rows` and `kernels.contact`; written. parameters: of all laws.
    trees: what moves on side A and B of each contact, -1 for nothing, shape (n, 2): contacts with a tree in common are
    one group. pulls, answers: the contact's axes as generalized forces on a side's tree, and the generalized velocities
    they cause, shape (n, 2, 3, coordinates): J and M^-1 J^T. Signs: A's motion less B's.

    Returns whether all of them are still: at rest, and with nothing to change until something moves.
    """
    n = rows.shape[0]
    if n == 0:
        return False
    if n == 1:
        start, index, blocks = wholes(work_io, 2), wholes(work_io, 1), zero_table(work_io, 1, 9)
        start[0], start[1], index[0] = 0, 1, 0
        for side in range(2):
            add_block(index[0], side, index[0], trees, pulls, answers, blocks[0])
        return integrate(start[0], start[1], rows, histories, parameters, start, index, blocks, dt, work_io)
    order, ends = groups(trees, work_io)
    sorted_rows, sorted_histories = table(work_io, n, rows.shape[1]), table(work_io, n, histories.shape[1])
    for i in range(n):
        copy(rows[order[i]], sorted_rows[i])
        copy(histories[order[i]], sorted_histories[i])
    start, index, blocks = mobility(order, trees, pulls, answers, work_io)
    first, still = start[0], True  # no literal: numba compiles a function anew for each one that it is given
    for last in ends:
        quiet = integrate(first, last, sorted_rows, sorted_histories, parameters, start, index, blocks, dt, work_io)
        still = still and quiet
        first = last
    for i in range(n):
        copy(sorted_rows[i], rows[order[i]])
        copy(sorted_histories[i], histories[order[i]])
    return still


@jit
def copy(values, out):
    """Copy all values (n,): cheaper than an assignment of slices, which may overlap."""
    for i in range(values.size):
        out[i] = values[i]


@jit
def integrate(first, last, rows, histories, parameters, start, index, blocks, dt, work_io):
    """One group over the step, the shortest way that will do; returns whether it is still."""
    n = last - first
    x, v = numbers(work_io, n), table(work_io, n, 3)
    force, acceleration = zero_table(work_io, n, 3), table(work_io, n, 3)
    for i in range(n):
        row = rows[first + i]
        x[i], row[CLOSED] = row[OVERLAP_NOW], dt
        for j in range(3):
            v[i, j] = row[MOTION + j]
        p, own = parameters_of(row, parameters), blocks[start[first + i]]
        resume(row, p, histories[first + i], own, force[i])
    accelerate(first, last, rows, start, index, blocks, force, acceleration)
    quiet = how_quiet(first, last, rows, histories, parameters, start, blocks, dt, x, v, force, acceleration)
    if quiet == RESTING:
        held = table(work_io, n, 3)
        copy(force.ravel(), held.ravel())
        if is_still(first, last, rows, histories, start, index, blocks, dt, x, v, held, acceleration):
            stay(first, last, rows, histories, start, blocks, dt, x, v, held, acceleration)
            return True
    if quiet == RESTING and n == 1:
        row = rows[first]
        settle(row, parameters_of(row, parameters), histories[first], blocks[start[first]], dt, force[0], work_io)
    else:  # several that rest are stiff to solve for, and calm enough after a few steps
        subcycle(
            first, last, rows, histories, parameters, start, index, blocks, dt, quiet != BUSY, x, v, force,
            acceleration, work_io,
        )  # fmt: skip
    return False


@jit
def count_trees(trees):
    """One more than the greatest number of a tree, at least one."""
    greatest = 0
    for i in range(trees.shape[0]):
        greatest = max(greatest, trees[i, 0], trees[i, 1])
    return greatest + 1


@jit
def find(parents, i):
    """Root of i in a forest of sets."""
    while parents[i] != i:
        parents[i] = parents[parents[i]]
        i = parents[i]
    return i


@jit
def connect(trees, work_io):
    """Contacts as a forest of sets, those that share what moves in one: the parent of each, see `find`."""
    n = trees.shape[0]
    owner, parents = wholes(work_io, count_trees(trees)), wholes(work_io, n)
    for i in range(owner.size):
        owner[i] = -1
    for i in range(n):
        parents[i] = i
    for i in range(n):
        for side in range(2):
            tree = trees[i, side]
            if tree < 0:
                continue
            if owner[tree] < 0:
                owner[tree] = i
            else:
                a, b = find(parents, owner[tree]), find(parents, i)
                parents[max(a, b)] = min(a, b)
    return parents


@jit
def groups(trees, work_io):
    """Contacts by group: their order, and where each group ends in it. Within a group the order stays."""
    n, parents = trees.shape[0], connect(trees, work_io)
    filled, order, ends = wholes(work_io, n + 1), wholes(work_io, n), wholes(work_io, n)
    for i in range(n + 1):
        filled[i] = 0
    for i in range(n):
        filled[find(parents, i) + 1] += 1
    count = 0
    for i in range(n):
        if filled[i + 1] > 0:
            ends[count] = filled[i] + filled[i + 1]
            count += 1
        filled[i + 1] += filled[i]
    for i in range(n):
        root = find(parents, i)
        order[filled[root]] = i
        filled[root] += 1
    return order, ends[:count]


@jit
def mobility(order, trees, pulls, answers, work_io):
    """J M^-1 J^T by rows of blocks: where each row starts, the column of each block, and the blocks (9).

    A row's first block is that of the contact with itself. Two contacts that share both bodies have two blocks.
    """
    n = order.size
    size = count_trees(trees)
    head, after = wholes(work_io, size), wholes(work_io, 2 * n)  # the sides that move each tree, as chains
    length, start = wholes(work_io, size), wholes(work_io, n + 1)
    for i in range(size):
        head[i], length[i] = -1, 0
    for k in range(n - 1, -1, -1):
        for side in range(1, -1, -1):
            tree = trees[order[k], side]
            if tree >= 0:
                after[2 * k + side] = head[tree]
                head[tree] = 2 * k + side
                length[tree] += 1
    start[0] = 0
    for k in range(n):
        one, two = trees[order[k], 0], trees[order[k], 1]
        others = 0
        if one >= 0:
            others += length[one] - (2 if one == two else 1)
        if two >= 0:
            others += length[two] - (2 if one == two else 1)
        start[k + 1] = start[k] + 1 + others
    index, blocks = wholes(work_io, start[n]), zero_table(work_io, start[n], 9)
    for k in range(n):
        own = at = start[k]
        index[own] = k
        for side in range(2):
            tree = trees[order[k], side]
            other = head[tree] if tree >= 0 else -1
            while other >= 0:
                d = other // 2
                if d == k:
                    add_side(order[k], side, order[d], other % 2, pulls, answers, blocks[own])
                else:
                    at += 1
                    index[at] = d
                    add_side(order[k], side, order[d], other % 2, pulls, answers, blocks[at])
                other = after[other]
    return start, index, blocks


@jit
def add_block(c, side, d, trees, pulls, answers, block_io):
    """Add what moves contact c on one side when contact d is pushed."""
    for other in range(2):
        if trees[c, side] >= 0 and trees[c, side] == trees[d, other]:
            add_side(c, side, d, other, pulls, answers, block_io)


@jit
def add_side(c, side, d, other, pulls, answers, block_io):
    """Add J_c M^-1 J_d^T of one side each, on the same tree."""
    sign = 1.0 if side == other else -1.0
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(pulls.shape[3]):
                total += pulls[c, side, i, k] * answers[d, other, j, k]
            block_io[3 * i + j] += sign * total


@jit
def couples(rows, trees, inverse_mass, arms, apart, speed, dt, out, work_io):
    """What the lever arms of undeformed bodies leave over of the angular momentum, for contacts of two free bodies.

    The forces on both act on their own surfaces, at the arms of the theory; these differ by the overlap and by the way
    that the bodies go while they touch. The rest is a couple, to be shared between both. With the true path between,
    the sum of X x force over the step is X_start x EARLY + X_end x (IMPULSE - EARLY), X from B's centre of mass to A's.

    inverse_mass (n, 2) [1/kg]: 0 where a side is not a free body. arms (n, 2, 3): from the centres of mass [m]. apart
    (n, 3): X now [m]. speed (n, 3): of A less B, mean over the step but for the contacts [m/s]. out (n, 3) [N m s]: on
    A where positive.
    """
    n = rows.shape[0]
    out[:] = 0.0
    pairs = 0
    for i in range(n):
        if inverse_mass[i, 0] != 0.0 and inverse_mass[i, 1] != 0.0:
            pairs += 1
    if pairs == 0:
        return
    gain = zero_table(work_io, count_trees(trees), 3)
    early, late = numbers(work_io, 3), numbers(work_io, 3)
    then, torque = numbers(work_io, 3), numbers(work_io, 3)
    for i in range(n):
        for side in range(2):
            if trees[i, side] >= 0:
                on_a(rows[i], rows[i, EARLY : EARLY + 3], early)
                for j in range(3):
                    gain[trees[i, side], j] += (1.0 - 2.0 * side) * inverse_mass[i, side] * early[j]
    for i in range(n):
        if inverse_mass[i, 0] == 0.0 or inverse_mass[i, 1] == 0.0:
            continue
        on_a(rows[i], rows[i, EARLY : EARLY + 3], early)
        on_a(rows[i], rows[i, IMPULSE : IMPULSE + 3], late)
        for j in range(3):
            then[j] = apart[i, j] + dt * (speed[i, j] + gain[trees[i, 0], j] - gain[trees[i, 1], j])
            torque[j] = arms[i, 0, j] - arms[i, 1, j]
        add_cross(torque, late, -1.0, out[i])
        add_cross(apart[i], early, -1.0, out[i])
        for j in range(3):
            late[j] -= early[j]
        add_cross(then, late, -1.0, out[i])


@jit
def on_a(row, impulse, out):
    """Impulse on A in the world frame of one along a contact's axes."""
    for j in range(3):
        out[j] = -(impulse[0] * row[FRAME + j] + impulse[1] * row[FRAME + 3 + j] + impulse[2] * row[FRAME + 6 + j])


@jit
def add_cross(a, b, factor, out):
    """Add factor times a x b."""
    out[0] += factor * (a[1] * b[2] - a[2] * b[1])
    out[1] += factor * (a[2] * b[0] - a[0] * b[2])
    out[2] += factor * (a[0] * b[1] - a[1] * b[0])
