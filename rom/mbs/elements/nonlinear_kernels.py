"""Forces of non-linear elements: each is a compiled law between the frames of a few bodies."""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import block_of
from rom.mbs.kernels.stages import REAL_VECTOR, TANGENT_TYPES, stage
from rom.mbs.kernels.system import System
from rom.mbs.kernels.work import Work


@intrinsic
def ask(context, address, numbers, pose, wanted, answer, space):
    """Call the law at an address with arrays; its signature is in `rom.mbs.elements.nonlinear`."""
    arrays = numbers, pose, answer, space
    signature = types.void(address, numbers, pose, wanted, answer, space)

    def build(context, builder, signature, arguments):
        def data(k):
            return context.make_array(signature.args[k])(context, builder, arguments[k]).data

        whole = ir.IntType(64)
        numbers = ir.DoubleType().as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [numbers, numbers, whole, numbers, numbers])
        law = builder.inttoptr(arguments[0], kind.as_pointer())
        builder.call(law, [data(1), data(2), arguments[3], data(4), data(5)])
        return context.get_dummy_value()

    return (signature, build) if all(isinstance(a, types.Array) for a in arrays) else None


@inner
def take_frames(s, W, e, q, v):
    """Copy the frames of element e to its row of W.pose."""
    N, bodies = s.nonlinear, s.bodies
    for k in range(N.count[e]):
        at, vt = bodies.q_at[N.body[e, k]], bodies.v_at[N.body[e, k]]
        for i in range(7):
            W.pose[e, 13 * k + i] = q[at + i]
        for i in range(6):
            W.pose[e, 13 * k + 7 + i] = v[vt + i]


def _has_elements(system):
    return system.nonlinear.address.size


@stage(types.void, System, Work, REAL_VECTOR, REAL_VECTOR, needed=_has_elements)
def nonlinear_residuals(s, W, q, v):
    """Add the forces of all elements to W.residual, and the power they lose to W.power[2]."""
    N = s.nonlinear
    for e in range(N.address.size):
        take_frames(s, W, e, q, v)
        ask(N.address[e], N.numbers[e], W.pose[e], 0, W.answer, W.space)
        W.power[2] += W.answer[1]
        for k in range(N.count[e]):
            t = s.bodies.v_at[N.body[e, k]]
            for i in range(6):
                W.residual[t + i] += W.answer[2 + 6 * k + i]


@stage(types.void, System, Work, *TANGENT_TYPES, needed=_has_elements)
def nonlinear_tangents(s, W, ck, cc, K, S):
    """Add stiffness times ck and damping times cc to K and S; `nonlinear_residuals` first."""
    N, graph = s.nonlinear, s.graph
    for e in range(N.address.size):
        ask(N.address[e], N.numbers[e], W.pose[e], 1, W.answer, W.space)
        n = 6 * N.count[e]
        for k in range(N.count[e]):
            for l in range(N.count[e]):
                block = block_of(graph, N.body[e, k], N.body[e, l])
                x, y = graph.x[block], graph.y[block]
                for i in range(6):
                    at = 2 + n + (6 * k + i) * n + 6 * l
                    for j in range(6):
                        K[x + i, y + j] += ck * W.answer[at + j]
                        S[x + i, y + j] += cc * W.answer[at + n * n + j]


@inner
def nonlinear_energy(s, W, q, v):
    """Energy stored in all elements."""
    N, total = s.nonlinear, 0.0
    for e in range(N.address.size):
        take_frames(s, W, e, q, v)
        ask(N.address[e], N.numbers[e], W.pose[e], 0, W.answer, W.space)
        total += W.answer[0]
    return total
