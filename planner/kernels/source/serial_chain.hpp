// Torques of a serial chain by the recursive Newton-Euler algorithm (Luh, Walker and Paul 1980), four states at a time.
#pragma once
#include "vectors.hpp"

struct Link {  // LINK_NUMBERS of planner/kernels/serial_chain.py
    double rotation[9], origin[3], mass, centre[3], inertia[9], turns;
};

// One joint and its link at four states.
struct Body { Matrix rotation; V3 offset, force, moment; };

// A chain, and memory for four of its states.
struct Chain {
    int64_t joints;
    const Link* links;
    const double* gravity;
    Scratch<Body> bodies;
    Scratch<V> states;  // (4, joints): position, velocity, acceleration, torque
    Chain(int64_t joints, const double* links, const double* gravity)
        : joints(joints), links(reinterpret_cast<const Link*>(links)), gravity(gravity), bodies(joints),
          states(4 * joints) {}
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

// Torques at four placed states. MOVES: with velocities; ACCELERATES: with accelerations; FALLS: with gravity.
template <bool MOVES, bool ACCELERATES, bool FALLS> static inline void torques(Chain& chain, const V* v, const V* a, V* tau) {
    const V O = splat(0.0);
    V3 w{O, O, O}, dw{O, O, O}, acc{O, O, O};
    if (FALLS) acc = -1.0 * constant(chain.gravity);
    for (int64_t i = 0; i < chain.joints; i++) {
        const Link& link = chain.links[i];
        Body& body = chain.bodies[i];
        if (ACCELERATES || MOVES) acc = acc + cross(dw, body.offset);
        if (MOVES) acc = acc + cross(w, cross(w, body.offset));
        acc = transposed(body.rotation, acc);
        if (ACCELERATES || MOVES) dw = transposed(body.rotation, dw);
        if (MOVES) w = transposed(body.rotation, w);
        if (link.turns != 0.0) {
            if (MOVES) { dw.x += w.y * v[i]; dw.y -= w.x * v[i]; w.z += v[i]; }
            if (ACCELERATES) dw.z += a[i];
        } else {
            if (MOVES) { acc.x += splat(2.0) * w.y * v[i]; acc.y -= splat(2.0) * w.x * v[i]; }
            if (ACCELERATES) acc.z += a[i];
        }
        const V3 centre = constant(link.centre);
        V3 at = acc, moment{O, O, O};
        if (ACCELERATES || MOVES) { at = at + cross(dw, centre); moment = product(link.inertia, dw); }
        if (MOVES) {
            at = at + cross(w, cross(w, centre));
            moment = moment + cross(w, product(link.inertia, w));
        }
        body.force = link.mass * at;
        body.moment = moment + cross(centre, body.force);
    }
    V3 force{O, O, O}, moment{O, O, O};
    for (int64_t i = chain.joints - 1; i >= 0; i--) {
        Body& body = chain.bodies[i];
        force = force + body.force;
        moment = moment + body.moment;
        tau[i] = chain.links[i].turns != 0.0 ? moment.z : force.z;
        force = body.rotation * force;
        moment = body.rotation * moment + cross(body.offset, force);
    }
}
