// What a motion needs and does on four intervals of its pieces, as Taylor models: torques, and the motion of the tool.
#pragma once
#include "serial_chain.hpp"
#include "taylor_models.hpp"

static inline Vector<Taylor> times(const Taylor& by, const Vector<Taylor>& a) { return {by * a.x, by * a.y, by * a.z}; }
static inline Taylor square(const Vector<Taylor>& a) { return a.x * a.x + a.y * a.y + a.z * a.z; }

// One joint and its link on four intervals: constant turns are not multiplied out.
struct TurnedBody {
    typedef Taylor Number;
    const Link* link;
    Taylor q, s, c;
    Vector<Taylor> force, moment;
    Vector<Taylor> into(const Vector<Taylor>& v) const {
        const double* m = link->rotation;
        const double back[9] = {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
        const Vector<Taylor> u = product(back, v);
        return link->turns != 0.0 ? Vector<Taylor>{c * u.x + s * u.y, c * u.y - s * u.x, u.z} : u;
    }
    Vector<Taylor> out(const Vector<Taylor>& v) const {
        return product(link->rotation, link->turns != 0.0 ? Vector<Taylor>{c * v.x - s * v.y, s * v.x + c * v.y, v.z} : v);
    }
    Vector<Taylor> swing(const Vector<Taylor>& turn) const {
        const Vector<Taylor> fixed = cross(turn, link->origin);
        if (link->turns != 0.0) return fixed;
        const double z[3] = {link->rotation[2], link->rotation[5], link->rotation[8]};
        const Vector<Taylor> slid = cross(turn, z);
        return fixed + times(q, slid);
    }
};

// Friction on four intervals. The Coulomb friction has one sign where the joint does not reverse, else it is between both. At the
// instant of a reversal, start or stop it counts as just before and just after.
static inline Taylor friction(const Link& link, const Taylor& v) {
    Taylor f = scaled(link.viscous, v);
    V reach = v.rest * splat(OF_SUMS) + splat(8.0 * UNIT) * v.size;
    for (int k = 1; k < TERMS; k++) reach += magnitude(v.c[k]);
    const V rest = splat(REST_SPEED), size = splat(link.coulomb), none = splat(0.0);
    const V low = v.c[0] - reach, high = v.c[0] + reach;
    const V lower = select(low >= none - rest, select(high <= rest, none, size), none - size);
    const V upper = select(high <= rest, select(low >= none - rest, none, none - size), size);
    f.c[0] += splat(0.5) * (lower + upper);
    f.size += size;
    f.rest += splat(0.5) * (upper - lower) + splat(4.0 * UNIT) * f.size;
    return f;
}

// Pieces of a motion on unit time: coefficients (pieces, joints, order), ascending, and their lengths, s.
struct Pieces {
    int64_t pieces, joints, order;
    const double *coefficients, *lengths;
};
// Intervals of unit time, one in each lane: piece, middle and half width.
struct Lanes { int64_t piece[W]; V middle, half; };

// The derivatives 0 to count - 1 by time of a joint on four intervals.
static inline void states_of(const Pieces& in, const Lanes& at, int64_t joint, int count, V* scratch, Taylor* states) {
    V length;
    V *shifted = scratch, *sizes = scratch + in.order;
    for (int l = 0; l < W; l++) {
        const double* row = in.coefficients + (at.piece[l] * in.joints + joint) * in.order;
        for (int64_t k = 0; k < in.order; k++) shifted[k][l] = row[k];
        length[l] = in.lengths[at.piece[l]];
    }
    for (int64_t k = 0; k < in.order; k++) sizes[k] = magnitude(shifted[k]);
    for (int64_t k = 0; k < in.order; k++)
        for (int64_t e = in.order - 2; e >= k; e--) shifted[e] += at.middle * shifted[e + 1];
    V width = splat(1.0);
    for (int64_t k = 0; k < in.order; k++, width *= at.half) shifted[k] *= width;
    const V pace = splat(1.0) / (at.half * length);
    V back = splat(1.0), slower = splat(1.0);
    for (int d = 0; d < count; d++, back *= pace, slower /= length) {
        Taylor t{};
        V rounding = splat(0.0);  // of the shift: by the sizes of the terms on all of the piece
        for (int64_t k = d; k < in.order; k++) {
            double factor = 1.0;
            for (int f = 0; f < d; f++) factor *= (double)(k - f);
            const V term = shifted[k] * (splat(factor) * back);
            if (k - d < TERMS) { t.c[k - d] = term; t.size += magnitude(term); }
            else t.rest += magnitude(term);
            rounding += sizes[k] * splat(factor);
        }
        t.rest += splat((double)(4 * in.order + 8) * UNIT) * rounding * slower;
        states[d] = t;
    }
}

// The velocity, acceleration and jerk of the tool, linear and angular, in the axes of its joint.
struct ToolMotion { Vector<Taylor> v[3], w[3]; };

// How the tool moves, at a place in the frame of the last of `joints`: derivatives up to `orders` of its path.
static inline void move_tool(int64_t joints, const TurnedBody* bodies, const Taylor* states, int64_t stride, int orders,
                             const double* tool, ToolMotion& out) {
    typedef Vector<Taylor> T3;
    T3 *v = out.v, *w = out.w;
    for (int d = 0; d < orders; d++) v[d] = w[d] = T3{};
    // Onward by a lever that is fixed behind the turns w: r' = w x r, and so on.
    auto lever = [&](auto swing) {
        const T3 first = swing(w[0]);
        v[0] = v[0] + first;
        if (orders < 2) return;
        const T3 second = swing(w[1]) + cross(w[0], first);
        v[1] = v[1] + second;
        if (orders < 3) return;
        v[2] = v[2] + swing(w[2]) + 2.0 * cross(w[1], first) + cross(w[0], swing(w[1])) + cross(w[0], cross(w[0], first));
    };
    for (int64_t i = 0; i < joints; i++) {
        const TurnedBody& body = bodies[i];
        const Taylor *rate = states + stride + i, *gain = states + 2 * stride + i, *jerk = states + 3 * stride + i;
        lever([&](const T3& turn) { return body.swing(turn); });
        for (int d = 0; d < orders; d++) { v[d] = body.into(v[d]); w[d] = body.into(w[d]); }
        // z turns with the frame before: z' = w x z, z'' = w' x z + w x (w x z). A joint that turns adds (v z)', (v z)'';
        // one that slides, what the rates of z q add to its second and third derivative.
        const bool turns = body.link->turns != 0.0;
        T3* to = turns ? w : v;
        const T3 once{w[0].y, number<Taylor>(0.0) - w[0].x, Taylor{}};
        if (orders > 2) {
            const T3 twice = T3{w[1].y, number<Taylor>(0.0) - w[1].x, Taylor{}} + cross(w[0], once);
            to[2] = to[2] + (turns ? 1.0 : 3.0) * times(*rate, twice) + (turns ? 2.0 : 3.0) * times(*gain, once);
            to[2].z = to[2].z + *jerk;
        }
        if (orders > 1) {
            to[1] = to[1] + (turns ? 1.0 : 2.0) * times(*rate, once);
            to[1].z = to[1].z + *gain;
        }
        to[0].z = to[0].z + *rate;
    }
    lever([&](const T3& turn) { return cross(turn, tool); });
}
