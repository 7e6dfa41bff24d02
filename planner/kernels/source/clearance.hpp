// Distances of the pieces of a robot from each other and from a scene: cheap bounds at joint positions, and proofs for whole
// motions, see planner/scene/continuous.py.
#pragma once
#include "convex.hpp"
#include "polynomials.hpp"

constexpr double UNKNOWN = -1e9;          // bound of a distance of which nothing is known, m
constexpr int SPHERES = 5;                // that cover a bounding capsule, of planner/scene/bodies.py
constexpr double ENOUGH_PARTS = 4.0;      // parts down to which a pair is split without a proved distance
constexpr int MOST_SPLITS = 6;            // parts of an interval that is split
constexpr int64_t KINDS = 3, ITSELF = 0;  // kinds of pairs; the others are those with obstacles

// The structures and their order are those of planner/kernels/clearance.py.
struct Joint { double rotation[9]; Vec origin; double turns, parent; };
struct Box { Frame frame; Vec halves; double edge, sphere, first_ball, balls; };  // with rounded edges, in a sphere
struct Plane { Vec normal; double offset; };
struct Ball { Vec centre; double radius; };

struct Scene {
    int64_t joints, bodies, boxes, planes, own, groups, points;
    const Joint* joint;
    const Piece* piece;  // of bodies, and of what stands still and has an end
    const double* point;
    const Box* box;      // about what stands still and has an end
    const Plane* plane;
    const Ball* ball;    // of clusters
    const int64_t *first, *second, *moved;  // (own,), (own,), (bodies, joints)
    const double* own_margin;               // (own,)
    const double* margin;                   // (bodies, obstacles): boxes, then planes; -inf: none
    const int64_t* kind;                    // the same
    const int64_t *member, *group_end;      // obstacles of groups; the last groups are one plane each
    const Ball* group;
    const double* group_margin;             // (KINDS - 1, bodies, groups): the largest

    int64_t obstacles() const { return boxes + planes; }
    Points all_points() const { return {point, point + points, point + 2 * points}; }
};

// Numbers in memory that grows; `push` returns null where there is none left.
template <class T> struct List {
    T* data = nullptr;
    int64_t count = 0, room = 0;
    List() = default;
    ~List() { free(data); }
    List(const List&) = delete;
    T& operator[](int64_t i) { return data[i]; }
    T* push() {
        if (count == room) {
            T* more = static_cast<T*>(realloc(data, (room = room ? 2 * room : 64) * sizeof(T)));
            if (!more) return nullptr;
            data = more;
        }
        return data + count++;
    }
};

// A pair that is too near for its cheap bound, at one joint position, and a plane that was found between its pieces.
struct Item {
    int64_t pair, kind;
    double near, motion, margin;  // bound of the distance, by how much it may shrink, and the least that is allowed
    Vec in_first, in_second;      // the normal in the frames of both joints; zero: none
    double low() const { return near - motion; }
    bool has_plane() const { return dot(in_first, in_first) > 0.0; }
};

// The robot at one joint position, and how far it may move from there.
struct PlacedRobot {
    const Scene& scene;
    Frame* frame;  // (joints + 1,), of the caller
    Scratch<double> levers, moves, sums;  // (bodies, joints) twice, (bodies,)
    Scratch<Vec> ends;                    // (bodies, 2)
    Scratch<V> sines;
    Scratch<char> is_placed;
    double* chords;  // (joints,)

    PlacedRobot(const Scene& scene, Frame* frame)
        : scene(scene), frame(frame), levers(scene.bodies * scene.joints), moves(scene.bodies * scene.joints),
          sums(scene.bodies), ends(2 * scene.bodies), sines(3 * (scene.joints / W + 1)), is_placed(scene.bodies),
          chords(reinterpret_cast<double*>(sines.data) + 2 * W * (scene.joints / W + 1)) {}
    explicit operator bool() const { return levers.data && moves.data && sums.data && ends.data && sines.data && is_placed.data; }

    // Put the joints at positions, from which they may change by `reach`.
    void put(const double* q, const double* reach) {
        const int64_t blocks = scene.joints / W + 1;
        V *s = sines.data, *c = s + blocks;
        double* chord = chords;
        for (int64_t b = 0; b < blocks; b++) {
            V angle = splat(0.0), half = splat(0.0), unused;
            for (int64_t k = 0, j = b * W; k < W && j < scene.joints; k++, j++) {
                angle[k] = q[j];
                half[k] = smallest(reach[j], M_PI) / 2.0;
            }
            V chord_of;
            sine_cosine(half, chord_of, unused);
            sine_cosine(angle, s[b], c[b]);
            for (int64_t k = 0, j = b * W; k < W && j < scene.joints; k++, j++)
                chord[j] = scene.joint[j].turns != 0.0 ? 2.0 * chord_of[k] * (1.0 + RELATIVE_ROUNDING) : reach[j];
        }
        frame[0] = BASE;
        for (int64_t j = 0; j < scene.joints; j++)
            if ((int64_t)scene.joint[j].parent <= j) put_joint(j, q, s, c);
        for (int64_t j = scene.joints - 1; j >= 0; j--)  // axes of a positioner, whose numbers grow towards the base
            if ((int64_t)scene.joint[j].parent > j) put_joint(j, q, s, c);
        memset(is_placed.data, 0, scene.bodies);
    }
    void put_joint(int64_t j, const double* q, const V* s, const V* c) {
        const Joint& joint = scene.joint[j];
        const Frame& before = frame[(int64_t)joint.parent];
        Frame& here = frame[j + 1];
        here.origin = before.placed(joint.origin);
        double turned[9];
        for (int r = 0; r < 3; r++)
            for (int k = 0; k < 3; k++)
                turned[3 * r + k] = before.r[3 * r] * joint.rotation[k] + before.r[3 * r + 1] * joint.rotation[3 + k] +
                                    before.r[3 * r + 2] * joint.rotation[6 + k];
        memcpy(here.r, turned, sizeof turned);
        if (joint.turns != 0.0) {
            const double sine = s[j / W][j % W], cosine = c[j / W][j % W];
            for (int r = 0; r < 9; r += 3) {
                here.r[r] = cosine * turned[r] + sine * turned[r + 1];
                here.r[r + 1] = cosine * turned[r + 1] - sine * turned[r];
            }
        } else {
            here.origin = here.origin + q[j] * here.column(2);
        }
    }

    // Place a body's capsule, and bound how far each joint moves it: by the chord at its largest distance from the axis.
    void place(int64_t body) {
        if (is_placed[body]) return;
        is_placed[body] = 1;
        const Piece& piece = scene.piece[body];
        const Frame& own = frame[(int64_t)piece.joint];
        const Vec start = own.placed(piece.start), end = own.placed(piece.end);
        ends[2 * body] = start;
        ends[2 * body + 1] = end;
        double sum = 0.0;
        for (int64_t j = 0; j < scene.joints; j++) {
            double lever = 0.0;
            if (scene.moved[body * scene.joints + j]) {
                lever = 1.0;
                if (scene.joint[j].turns != 0.0) {
                    const Vec axis = frame[j + 1].column(2), u = start - frame[j + 1].origin, w = end - frame[j + 1].origin;
                    const Vec from_u = u - dot(u, axis) * axis, from_w = w - dot(w, axis) * axis;
                    const double square = largest(dot(from_u, from_u), dot(from_w, from_w));
                    lever = (sqrt(square) + piece.capsule) * (1.0 + RELATIVE_ROUNDING) + RELATIVE_ROUNDING;
                }
            }
            levers[body * scene.joints + j] = lever;
            sum += moves[body * scene.joints + j] = lever * chords[j];
        }
        sums[body] = sum;
    }

    // Bound the distance of two bodies by their capsules, and how much it may shrink.
    void bound_own(int64_t pair, double enough, Item& item) {
        const int64_t a = scene.first[pair], b = scene.second[pair], joints = scene.joints;
        place(a);
        place(b);
        item.motion = 0.0;
        for (int64_t j = 0; j < joints; j++)
            if (scene.moved[a * joints + j] != scene.moved[b * joints + j])
                item.motion += moves[a * joints + j] + moves[b * joints + j];
        const Piece &first = scene.piece[a], &second = scene.piece[b];
        const double radii = first.capsule + second.capsule;
        const Vec u = 0.5 * (ends[2 * a + 1] - ends[2 * a]), w = 0.5 * (ends[2 * b + 1] - ends[2 * b]);
        const Vec way = (ends[2 * a] + u) - (ends[2 * b] + w);
        item.near = (length(way) - length(u) - length(w) - radii) - RELATIVE_ROUNDING * (1.0 + extent(ends[2 * a]) + extent(ends[2 * b]));
        if (item.low() >= enough) return;
        item.near = largest(item.near, segment_distance(ends[2 * a], ends[2 * a + 1], ends[2 * b], ends[2 * b + 1]) - radii);
    }

    // Bound the distance of a body from an obstacle: by its box, and ball by ball where that is less than enough.
    double bound(int64_t body, int64_t obstacle, double enough) {
        const Piece& piece = scene.piece[body];
        const Vec start = ends[2 * body], end = ends[2 * body + 1];
        if (obstacle >= scene.boxes) {
            const Plane& plane = scene.plane[obstacle - scene.boxes];
            const double scale = 1.0 + extent(start) + extent(end) + fabs(plane.offset);
            return smallest(dot(plane.normal, start), dot(plane.normal, end)) - plane.offset - piece.capsule - RELATIVE_ROUNDING * scale;
        }
        const Box& box = scene.box[obstacle];
        double near = INFINITY;
        for (int k = 0; k < SPHERES; k++) {
            const Vec at = box.frame.turned_back(start + (k / (SPHERES - 1.0)) * (end - start) - box.frame.origin);
            const Vec out = {largest(fabs(at.x) - box.halves.x, 0.0), largest(fabs(at.y) - box.halves.y, 0.0),
                             largest(fabs(at.z) - box.halves.z, 0.0)};
            near = smallest(near, dot(out, out));
        }
        const double rounding = RELATIVE_ROUNDING * (1.0 + extent(start) + extent(box.frame.origin));
        near = sqrt(near) - box.edge - piece.cover - rounding;
        if (!(near >= 0.0)) near = UNKNOWN;  // boxes that are met say nothing of how deep pieces overlap
        if (box.balls > 0.0 && near < enough) {
            double balls = INFINITY;
            const Ball* ball = scene.ball + (int64_t)box.first_ball;
            for (int64_t i = 0; i < (int64_t)box.balls; i++)
                balls = smallest(balls, point_distance(ball[i].centre, start, end) - ball[i].radius);
            near = largest(near, balls - piece.capsule - rounding);
        }
        return near;
    }

    // The distances of a sphere about a body from a ball, and from a plane.
    double from_plane(Vec centre, double radius, const Plane& plane) const {
        return dot(plane.normal, centre) - plane.offset - radius - RELATIVE_ROUNDING * (1.0 + extent(centre) + fabs(plane.offset));
    }
    double from_ball(Vec centre, double radius, const Ball& ball) const {
        return length(centre - ball.centre) - ball.radius - radius - RELATIVE_ROUNDING * (1.0 + extent(centre) + extent(ball.centre));
    }

    // Bound the distance of a pair again, by a plane that was found elsewhere and moved with either piece.
    double plane_bound(const Item& item) {
        const Piece *a, *b;
        const Frame *fa, *fb;
        pieces(item.pair, a, fa, b, fb);
        const Vec n = fa->turned(item.in_first), m = fb->turned(item.in_second);
        const Points points = scene.all_points();
        return largest(across(points, *a, *fa, *b, *fb, n), across(points, *a, *fa, *b, *fb, m)) - RELATIVE_ROUNDING;
    }

    void pieces(int64_t pair, const Piece*& a, const Frame*& fa, const Piece*& b, const Frame*& fb) const {
        if (pair < scene.own) {
            a = scene.piece + scene.first[pair];
            b = scene.piece + scene.second[pair];
            fb = frame + (int64_t)b->joint;
        } else {
            a = scene.piece + (pair - scene.own) / scene.obstacles();
            b = scene.piece + scene.bodies + (pair - scene.own) % scene.obstacles();
            fb = frame;
        }
        fa = frame + (int64_t)a->joint;
    }

    // How far a pair is apart, unless GJK finds out nothing that is proved; without a normal for planes and clusters.
    Apart apart(const Item& item, double enough) {
        const Points points = scene.all_points();
        const Piece *a, *b;
        const Frame *fa, *fb;
        pieces(item.pair, a, fa, b, fb);
        const int64_t obstacle = item.pair < scene.own ? -1 : (item.pair - scene.own) % scene.obstacles();
        if (obstacle >= scene.boxes) {
            const Plane& plane = scene.plane[obstacle - scene.boxes];
            const double distance = -support(points, *a, *fa, -plane.normal) - plane.offset;
            const double scale = 1.0 + fabs(plane.offset) + extent(fa->origin) + a->extent;
            return {distance - RELATIVE_ROUNDING * scale, distance, {0.0, 0.0, 0.0}};
        }
        if (obstacle < 0 || !(scene.box[obstacle].balls > 0.0))
            return separation(points, *a, *fa, *b, *fb, item.has_plane() ? fa->turned(item.in_first) : Vec{0.0, 0.0, 0.0}, enough);
        const Box& box = scene.box[obstacle];
        const int64_t body = (item.pair - scene.own) / scene.obstacles();
        Apart least{INFINITY, INFINITY, {0.0, 0.0, 0.0}};
        for (int64_t i = 0; i < (int64_t)box.balls; i++) {
            const Ball& ball = scene.ball[(int64_t)box.first_ball + i];
            const double scale = 1.0 + extent(ball.centre) + extent(ends[2 * body]) + extent(ends[2 * body + 1]);
            const double bound = point_distance(ball.centre, ends[2 * body], ends[2 * body + 1]) - ball.radius - a->capsule;
            if (bound - RELATIVE_ROUNDING * scale >= smallest(enough, least.distance)) {
                least.proved = smallest(least.proved, bound - RELATIVE_ROUNDING * scale);
                continue;
            }
            Apart found{bound - RELATIVE_ROUNDING * scale, bound, {0.0, 0.0, 0.0}};
            if (a->is_round == 0.0) {
                const Piece one{0.0, 0.0, 0.0, ball.radius, 0.0, {}, ball.centre, ball.centre, 0.0, 0.0, extent(ball.centre), 1.0};
                found = separation(points, *a, *fa, one, BASE, {0.0, 0.0, 0.0}, enough);
            }
            if (found.proved < enough && !found.is_known()) return {found.proved, smallest(found.distance, least.distance), {0.0, 0.0, 0.0}};
            least.proved = smallest(least.proved, found.proved);
            least.distance = smallest(least.distance, found.distance);
        }
        return least;
    }
};

// From which distances on pairs need no closer look: their margins, and what is known already where it is measured.
struct Wanted {
    double contact, tolerance, upper[KINDS];  // tolerance: infinite where nothing is measured
    double of(int64_t kind, double margin) const { return largest(margin - contact, upper[kind] - tolerance); }
};

// Collect the pairs at a joint position that cheap bounds leave too near, and the least bounds (KINDS,) of all others.
static inline int gather(PlacedRobot& at, const Wanted& wanted, double own_margin, List<Item>& items, double* lower) {
    const Scene& scene = at.scene;
    for (int64_t pair = 0; pair < scene.own && own_margin > -INFINITY; pair++) {
        Item item{pair, ITSELF, 0.0, 0.0, own_margin + scene.own_margin[pair], {}, {}};
        const double enough = wanted.of(ITSELF, item.margin);
        at.bound_own(pair, enough, item);
        if (item.low() >= enough) { lower[ITSELF] = smallest(lower[ITSELF], item.low()); continue; }
        Item* place = items.push();
        if (!place) return NO_MEMORY;
        *place = item;
    }
    for (int64_t body = 0; body < scene.bodies; body++) {
        at.place(body);
        const Vec start = at.ends[2 * body], end = at.ends[2 * body + 1], centre = 0.5 * (start + end);
        const double radius = 0.5 * length(end - start) + scene.piece[body].capsule, moved = at.sums[body];
        for (int64_t group = 0; group < scene.groups; group++) {
            const double* margin = scene.group_margin + body * scene.groups + group;
            const int64_t of_kind = scene.bodies * scene.groups, begin = group ? scene.group_end[group - 1] : 0;
            if (margin[0] == -INFINITY && margin[of_kind] == -INFINITY) continue;
            const int64_t only = scene.member[begin];
            const double low = (only >= scene.boxes ? at.from_plane(centre, radius, scene.plane[only - scene.boxes])
                                                    : at.from_ball(centre, radius, scene.group[group])) - moved;
            bool is_near = false;
            for (int64_t kind = 1; kind < KINDS; kind++) {
                const double least = margin[(kind - 1) * of_kind];
                if (least == -INFINITY) continue;
                if (low >= wanted.of(kind, least)) lower[kind] = smallest(lower[kind], low);
                else is_near = true;
            }
            for (int64_t k = begin; is_near && k < scene.group_end[group]; k++) {
                const int64_t obstacle = scene.member[k], cell = body * scene.obstacles() + obstacle, kind = scene.kind[cell];
                if (scene.margin[cell] == -INFINITY) continue;
                const double enough = wanted.of(kind, scene.margin[cell]);
                Item item{scene.own + cell, kind, 0.0, moved, scene.margin[cell], {}, {}};
                if (obstacle < scene.boxes) {
                    const Box& box = scene.box[obstacle];
                    item.near = at.from_ball(centre, radius, {box.frame.origin, box.sphere});
                    if (item.low() >= enough) { lower[kind] = smallest(lower[kind], item.low()); continue; }
                }
                item.near = at.bound(body, obstacle, enough + moved);
                if (item.low() >= enough) { lower[kind] = smallest(lower[kind], item.low()); continue; }
                Item* place = items.push();
                if (!place) return NO_MEMORY;
                *place = item;
            }
        }
    }
    return OK;
}

// Measures a pair where GJK finds nothing that is proved: fills proved distance, distance and normal; another code than 0
// stops the kernel.
typedef int (*Measure)(int64_t pair, double* measured);

// Joint positions, one or those within the reach of one: FREE, all keep every margin; BLOCKED, none does; UNDECIDED, neither is
// proved.
enum Decision : int64_t { FREE, UNDECIDED, BLOCKED };

// Decide the joint position that a robot is placed at, without excursions.
static inline int decide_position(PlacedRobot& at, const Wanted& wanted, List<Item>& items, Measure measure, int64_t& decision) {
    double lower[KINDS] = {};
    items.count = 0;
    decision = FREE;
    if (const int code = gather(at, wanted, 0.0, items, lower)) return code;
    for (int64_t i = 0; i < items.count && decision != BLOCKED; i++) {
        const double enough = wanted.of(items[i].kind, items[i].margin);
        const Apart apart = at.apart(items[i], enough);
        double measured[5] = {apart.proved, apart.distance};
        if (apart.proved < enough && apart.distance >= enough && !apart.is_known())
            if (const int code = measure(items[i].pair, measured)) return code;
        if (measured[0] >= enough) continue;
        decision = measured[1] < enough ? BLOCKED : UNDECIDED;
    }
    return OK;
}

// Decide the joint positions within the reach of the one that a robot is placed at; BLOCKED only on request. It is then
// tried for one pair that is not proved free: depths of overlaps are measured elsewhere, which takes long.
static inline int decide(PlacedRobot& at, const Wanted& wanted, List<Item>& items, bool tries_blocked, Measure measure,
                         int64_t& decision) {
    double lower[KINDS], measured[5];
    items.count = 0;
    decision = FREE;
    if (const int code = gather(at, wanted, 0.0, items, lower)) return code;
    for (int64_t i = 1; i < items.count; i++)
        if (items[i].near < items[0].near) { const Item nearer = items[i]; items[i] = items[0]; items[0] = nearer; }
    for (int64_t i = 0; i < items.count; i++) {
        const Item& item = items[i];
        const double margin = wanted.of(item.kind, item.margin);
        if (at.apart(item, margin + item.motion).proved >= margin + item.motion) continue;
        decision = UNDECIDED;
        if (!tries_blocked) return OK;
        if (const int code = measure(item.pair, measured)) return code;
        if (measured[1] + item.motion < margin) decision = BLOCKED;
        return OK;
    }
    return OK;
}
