// Torques of a serial chain by the recursive Newton-Euler algorithm (Luh, Walker and Paul 1980), for every kind of number:
// of four states at a time, or Taylor models of four intervals (enclosures.hpp).
#pragma once
#include "vectors.hpp"

struct Link {  // LINK_NUMBERS of planner/kernels/serial_chain.py
    double rotation[9], origin[3], mass, centre[3], inertia[9], turns, rotor, coulomb, viscous;
};
constexpr double REST_SPEED = 1e-9;  // REST_SPEED of planner/kernels/serial_chain.py: no slower joint has Coulomb friction
static inline V friction(const Link& link, V v) {
    const V none = splat(0.0), size = splat(link.coulomb);
    return select(v > splat(REST_SPEED), size, select(v < splat(-REST_SPEED), none - size, none)) + splat(link.viscous) * v;
}

// Free fall in the frame that stands still; and the force that the tool exerts at a point of a link, in the axes of that link, or
// in the base's. No link has the number -1. Then the number of the joints of a positioner, which come first. The link behind them
// stands still; without a positioner it is the base.
struct Load {  // LOAD_NUMBERS of planner/kernels/serial_chain.py
    double gravity[3], force[3], moment[3], point[3], link, in_base, positioner;
};

// One joint and its link at four states.
struct Body {
    typedef V Number;
    Matrix rotation;
    V3 offset, force, moment;
    V3 into(const V3& v) const { return transposed(rotation, v); }
    V3 out(const V3& v) const { return rotation * v; }
    V3 swing(const V3& turn) const { return cross(turn, offset); }  // of its origin about that of the joint before
};

// A chain, and memory for four of its states.
struct Chain {
    int64_t joints;
    const Link* links;
    const Load& load;
    Scratch<Body> bodies;
    Scratch<V> states;  // (4, joints): position, velocity, acceleration, torque
    Chain(int64_t joints, const double* links, const double* load)
        : joints(joints), links(reinterpret_cast<const Link*>(links)), load(*reinterpret_cast<const Load*>(load)),
          bodies(joints), states(4 * joints) {}
    explicit operator bool() const { return bodies && states; }
    V* state(int64_t which) { return states.data + which * joints; }
};

// Rotations and offsets of all joints at four positions.
static inline void place(Chain& chain, const V* q) {
    for (int64_t i = 0; i < chain.joints; i++) {
        const Link& link = chain.links[i];
        Body& body = chain.bodies[i];
        for (int r = 0; r < 9; r++) body.rotation.m[r] = splat(link.rotation[r]);
        body.offset = constant(link.origin);
        V* m = body.rotation.m;
        if (link.turns != 0.0) {
            V s, c;
            sine_cosine(q[i], s, c);
            for (int r = 0; r < 9; r += 3) {
                V a = m[r], b = m[r + 1];
                m[r] = a * c + b * s;
                m[r + 1] = b * c - a * s;
            }
        } else {
            body.offset = body.offset + V3{m[2] * q[i], m[5] * q[i], m[8] * q[i]};
        }
    }
}

// The force on a body, and its moment about the origin of its frame, by its motion.
template <bool MOVES, bool ACCELERATES, class B, class S>
static inline void wrench(const Link& link, B& body, const Vector<S>& w, const Vector<S>& dw, const Vector<S>& acc) {
    Vector<S> at = acc, moment{};
    if (ACCELERATES || MOVES) { at = at + cross(dw, link.centre); moment = product(link.inertia, dw); }
    if (MOVES) {
        at = at + cross(w, cross(w, link.centre));
        moment = moment + cross(w, product(link.inertia, w));
    }
    body.force = link.mass * at;
    body.moment = moment - cross(body.force, link.centre);
}
template <bool MOVES, bool ACCELERATES, bool FALLS, class S>
static inline void add_drive(const Link& link, const S* v, const S* a, int64_t i, S* tau) {
    if (ACCELERATES && link.rotor != 0.0) tau[i] = tau[i] + scaled(link.rotor, a[i]);
    if (MOVES && FALLS && (link.coulomb != 0.0 || link.viscous != 0.0)) tau[i] = tau[i] + friction(link, v[i]);
}

// Torques of a positioner, from the link that stands still to the workpiece, which is the base: against the order of the chain.
// The row of a joint has the inertia of the link before it, in that link's frame.
template <bool MOVES, bool ACCELERATES, bool FALLS, class B, class S = typename B::Number>
static inline void torques_of_positioner(const Link* links, const Load& load, B* bodies, const S* v, const S* a, S* tau) {
    const Vector<S> O{};
    const int64_t joints = (int64_t)load.positioner;
    Vector<S> w = O, dw = O, acc = O;
    if (FALLS) acc = acc - constant<S>(load.gravity);
    for (int64_t i = joints - 1; i >= 0; i--) {
        B& body = bodies[i];
        if (links[i].turns != 0.0) {
            if (MOVES) { dw.x = dw.x - w.y * v[i]; dw.y = dw.y + w.x * v[i]; w.z = w.z - v[i]; }
            if (ACCELERATES) dw.z = dw.z - a[i];
        } else {
            if (MOVES) { acc.x = acc.x - scaled(2.0, w.y) * v[i]; acc.y = acc.y + scaled(2.0, w.x) * v[i]; }
            if (ACCELERATES) acc.z = acc.z - a[i];
        }
        acc = body.out(acc);
        if (ACCELERATES || MOVES) { dw = body.out(dw); acc = acc - body.swing(dw); }
        if (MOVES) { w = body.out(w); acc = acc - cross(w, body.swing(w)); }
        wrench<MOVES, ACCELERATES>(links[i], body, w, dw, acc);
    }
    Vector<S> force = O, moment = O;
    for (int64_t i = 0; i < joints; i++) {
        B& body = bodies[i];
        force = force + body.force;
        moment = moment + body.moment;
        moment = body.into(moment + body.swing(force));
        force = body.into(force);
        tau[i] = S{} - (links[i].turns != 0.0 ? moment.z : force.z);
        add_drive<MOVES, ACCELERATES, FALLS>(links[i], v, a, i, tau);
    }
}

// Torques of placed bodies. MOVES: with velocities; ACCELERATES: with accelerations; FALLS: with the load. All three: with
// friction, too.
template <bool MOVES, bool ACCELERATES, bool FALLS, class B, class S = typename B::Number>
static inline void torques(int64_t joints, const Link* links, const Load& load, B* bodies, const S* v, const S* a, S* tau) {
    const Vector<S> O{};
    Vector<S> w = O, dw = O, acc = O;
    Vector<S> push = O, twist = O;
    if (FALLS) { acc = acc - constant<S>(load.gravity); push = constant<S>(load.force); twist = constant<S>(load.moment); }
    const int64_t first = (int64_t)load.positioner;
    if (first) torques_of_positioner<MOVES, ACCELERATES, FALLS>(links, load, bodies, v, a, tau);
    if (FALLS && load.in_base != 0.0)
        for (int64_t i = 0; i < first; i++) { push = bodies[i].into(push); twist = bodies[i].into(twist); }
    for (int64_t i = first; i < joints; i++) {
        const Link& link = links[i];
        B& body = bodies[i];
        if (ACCELERATES || MOVES) acc = acc + body.swing(dw);
        if (MOVES) acc = acc + cross(w, body.swing(w));
        acc = body.into(acc);
        if (ACCELERATES || MOVES) dw = body.into(dw);
        if (MOVES) w = body.into(w);
        if (link.turns != 0.0) {
            if (MOVES) { dw.x = dw.x + w.y * v[i]; dw.y = dw.y - w.x * v[i]; w.z = w.z + v[i]; }
            if (ACCELERATES) dw.z = dw.z + a[i];
        } else {
            if (MOVES) { acc.x = acc.x + scaled(2.0, w.y) * v[i]; acc.y = acc.y - scaled(2.0, w.x) * v[i]; }
            if (ACCELERATES) acc.z = acc.z + a[i];
        }
        wrench<MOVES, ACCELERATES>(link, body, w, dw, acc);
        if (FALLS && (double)i <= load.link) {
            if (load.in_base != 0.0) { push = body.into(push); twist = body.into(twist); }
            if ((double)i == load.link) {
                body.force = body.force + push;
                body.moment = body.moment + twist - cross(push, load.point);
            }
        }
    }
    Vector<S> force = O, moment = O;
    for (int64_t i = joints - 1; i >= first; i--) {
        B& body = bodies[i];
        force = force + body.force;
        moment = moment + body.moment;
        tau[i] = links[i].turns != 0.0 ? moment.z : force.z;
        add_drive<MOVES, ACCELERATES, FALLS>(links[i], v, a, i, tau);
        force = body.out(force);
        moment = body.out(moment) - body.swing(force);
    }
    if (!FALLS || !first || load.link < 0.0) return;
    force = push;  // between tool and workpiece: it goes on through the positioner
    moment = twist - cross(push, load.point);
    for (int64_t i = (int64_t)load.link; i >= 0; i--) {
        if (i < first) tau[i] = tau[i] + (links[i].turns != 0.0 ? moment.z : force.z);
        force = bodies[i].out(force);
        moment = bodies[i].out(moment) - bodies[i].swing(force);
    }
}

// Magnitudes of a link: the distance of its joint from the one before, the mass, the first moments and the inertia about the
// origin of its joint. The last row of a chain has free fall, force and moment of the tool, the index of its link, and the number
// of the joints of a positioner.
struct Magnitude { double reach, mass, first, second, turns; };  // MAGNITUDE_NUMBERS of planner/kernels/serial_chain.py
// The same recursions with magnitudes in place of vectors: no torque of the chain is larger at any position of its joints, with these
// magnitudes of velocities and accelerations. `scratch` has room for two numbers of each joint.
static inline void torque_magnitudes(int64_t joints, const Magnitude* rows, const double* v, const double* a, double* scratch, double* tau) {
    const Magnitude& load = rows[joints];
    const int64_t first = (int64_t)load.turns;
    double w = 0.0, dw = 0.0, acc = load.reach, force = 0.0, moment = 0.0;
    auto swing = [&](int64_t i) { acc += (dw + w * w) * rows[i].reach; };
    auto move = [&](int64_t i) {
        if (rows[i].turns != 0.0) { dw += a[i] + w * v[i]; w += v[i]; }
        else acc += a[i] + 2.0 * w * v[i];
    };
    auto wrench = [&](int64_t i, bool is_loaded) {
        const Magnitude& row = rows[i];
        scratch[2 * i] = row.mass * acc + (dw + w * w) * row.first + (is_loaded ? load.mass : 0.0);
        scratch[2 * i + 1] = row.first * acc + (dw + w * w) * row.second + (is_loaded ? load.first : 0.0);
    };
    auto of_joint = [&](int64_t i) { return rows[i].turns != 0.0 ? moment : force; };
    for (int64_t i = first - 1; i >= 0; i--) { move(i); swing(i); wrench(i, false); }
    for (int64_t i = 0; i < first; i++) {
        force += scratch[2 * i];
        moment += scratch[2 * i + 1] + rows[i].reach * force;
        tau[i] = of_joint(i);
    }
    w = dw = force = moment = 0.0;
    acc = load.reach;
    for (int64_t i = first; i < joints; i++) { swing(i); move(i); wrench(i, (double)i == load.second); }
    for (int64_t i = joints - 1; i >= first; i--) {
        force += scratch[2 * i];
        moment += scratch[2 * i + 1];
        tau[i] = of_joint(i);
        moment += rows[i].reach * force;
    }
    force = load.mass;
    moment = load.first;
    for (int64_t i = first ? (int64_t)load.second : -1; i >= 0; i--) {
        if (i < first) tau[i] += of_joint(i);
        moment += rows[i].reach * force;
    }
}
template <bool MOVES, bool ACCELERATES, bool FALLS> static inline void torques(Chain& chain, const V* v, const V* a, V* tau) {
    torques<MOVES, ACCELERATES, FALLS>(chain.joints, chain.links, chain.load, chain.bodies.data, v, a, tau);
}
