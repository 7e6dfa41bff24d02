// The proof that a motion keeps clear at all times: intervals are looked at in their middles, the most suspicious first,
// and split for the pairs that are not done with, see planner/scene/continuous.py.
#pragma once
#include "clearance.hpp"

// What the joints do: coefficients (pieces, joints, order), ascending powers of the time since the piece's beginning.
struct Motion {
    int64_t pieces, joints, order;
    const double *lengths, *coefficients, *breakpoints;

    double end() const { return breakpoints[pieces]; }
    int64_t piece_at(double time, bool later) const {  // at a breakpoint the later piece, or the one before
        int64_t low = 0, high = pieces - 1;
        while (low < high) {
            const int64_t middle = (low + high) / 2;
            const double next = breakpoints[middle + 1];
            if (later ? next <= time : next < time) low = middle + 1; else high = middle;
        }
        return low;
    }
    const double* of(int64_t piece, int64_t joint) const { return coefficients + (piece * joints + joint) * order; }
    void positions(double time, double* q) const {
        const int64_t piece = piece_at(time, true);
        const double x = smallest(time - breakpoints[piece], lengths[piece]);
        for (int64_t j = 0; j < joints; j++) q[j] = horner(of(piece, j), order, x);
    }
    void velocities(double time, double* v) const {
        const int64_t piece = piece_at(time, true);
        const double x = smallest(time - breakpoints[piece], lengths[piece]);
        for (int64_t j = 0; j < joints; j++) {
            const double* c = of(piece, j);
            v[j] = 0.0;
            for (int64_t k = order - 1; k > 0; k--) v[j] = v[j] * x + (double)k * c[k];
        }
    }
};

// Bounds (joints,) of |q(t) - q - v (t - middle)| in an interval of time by Bernstein coefficients, rounding included.
static inline void excursions(const Motion& motion, double start, double end, const double* q, const double* v,
                              const double* matrix, double* local, double* out) {
    const int64_t order = motion.order, first = motion.piece_at(start, true);
    int64_t last = motion.piece_at(end, false);
    if (last < first) last = first;
    for (int64_t j = 0; j < motion.joints; j++) out[j] = 0.0;
    for (int64_t piece = first; piece <= last; piece++) {
        const double begin = largest(start - motion.breakpoints[piece], 0.0);
        const double stop = largest(smallest(end - motion.breakpoints[piece], motion.lengths[piece]), begin), width = stop - begin;
        const double since = motion.breakpoints[piece] + begin - (start + end) / 2.0;
        for (int64_t j = 0; j < motion.joints; j++) {
            memcpy(local, motion.of(piece, j), order * sizeof(double));
            double size = 0.0, power = 1.0;
            for (int64_t k = 0; k < order; k++) { size += fabs(local[k]) * power; power *= stop; }
            for (int64_t m = 0; m < order; m++)
                for (int64_t k = order - 2; k >= m; k--) local[k] += begin * local[k + 1];
            power = 1.0;
            for (int64_t k = 0; k < order; k++) { local[k] *= power; power *= width; }
            double away = 0.0;
            for (int64_t i = 0; i < order; i++) {
                double value = local[0] - q[j];
                for (int64_t k = 1; k <= i; k++) value += local[k] * matrix[k * order + i];
                if (v) value -= v[j] * (since + (order > 1 ? width * (double)i / (double)(order - 1) : 0.0));
                away = largest(away, fabs(value));
            }
            away += RELATIVE_ROUNDING * (size + fabs(q[j]));
            if (v) away += RELATIVE_ROUNDING * fabs(v[j]) * motion.end();
            out[j] = largest(out[j], away);
        }
    }
}

// The request of a proof, PROOF_NUMBERS of planner/kernels/clearance.py.
struct Request { double contact, tolerance, parts, least_share, positions, distances; };

// What is known of a pair.
struct Seen { double distance, time, pair; };

// What was found, FOUND_NUMBERS there: least distances of each kind, proved and seen; what is too near, what is unproved.
struct Found {
    double lower[KINDS];
    Seen nearest[KINDS], hit, undecided;
    double hit_missing, positions, distances;
};

class Proof {
    struct Items { int64_t users, count; Item item[1]; };
    struct Node { double start, end, urgency; int64_t number; Items* items; };

    const Scene& scene;
    const Motion& motion;
    const Request& request;
    Measure measure;
    Found& found;
    PlacedRobot at;
    Wanted wanted;
    Scratch<double> q, v, reach, rest, matrix, local;
    List<Node> nodes;  // a heap
    List<Item> items;
    List<int64_t> ordered;  // rows of the items
    int64_t numbered = 0;
    double middle = 0.0, start = 0.0, end = 0.0;
    bool has_velocities = false;

    bool is_measured() const { return request.tolerance < INFINITY; }
    bool has_hit() const { return found.hit.pair >= 0.0; }
    bool has_budget() const { return found.positions < request.positions && found.distances < request.distances; }
    static bool is_before(const Node& a, const Node& b) {
        return a.urgency != b.urgency ? a.urgency < b.urgency : a.number < b.number;
    }

    int push(double start, double end, double urgency, Items* items) {
        if (!nodes.push()) return NO_MEMORY;
        int64_t k = nodes.count - 1;
        const Node node{start, end, urgency, numbered++, items};
        for (; k && is_before(node, nodes[(k - 1) / 2]); k = (k - 1) / 2) nodes[k] = nodes[(k - 1) / 2];
        nodes[k] = node;
        return OK;
    }

    Node pop() {
        const Node top = nodes[0], last = nodes[--nodes.count];
        int64_t k = 0, child;
        while ((child = 2 * k + 1) < nodes.count) {
            if (child + 1 < nodes.count && is_before(nodes[child + 1], nodes[child])) child++;
            if (!is_before(nodes[child], last)) break;
            nodes[k] = nodes[child];
            k = child;
        }
        nodes[k] = last;
        return top;
    }

    static void release(Items* items) { if (items && !--items->users) free(items); }

    void put(double from, double to) {
        start = from; end = to; middle = (from + to) / 2.0;
        has_velocities = false;
        motion.positions(middle, q.data);
        excursions(motion, start, end, q.data, nullptr, matrix.data, local.data, reach.data);
        at.put(q.data, reach.data);
    }

    void lower(const Item& item) { found.lower[item.kind] = smallest(found.lower[item.kind], item.low()); }

    // Prove the distance of a pair at the joint position, as far as is wanted.
    int look(Item& item) {
        const double enough = wanted.of(item.kind, item.margin) + item.motion;
        Apart apart = at.apart(item, enough);
        found.distances += 1.0;
        bool is_known = apart.is_known() || (!is_measured() && item.margin - apart.distance > request.contact);
        if (apart.proved < enough && !is_known) {
            double out[5];
            if (const int code = measure(item.pair, out)) return code;
            apart = {out[0], out[1], {out[2], out[3], out[4]}};
            is_known = true;
        }
        const Seen seen{apart.distance, middle, (double)item.pair};
        if (is_known && apart.distance < wanted.upper[item.kind]) {
            wanted.upper[item.kind] = apart.distance;
            found.nearest[item.kind] = seen;
        }
        const double missing = item.margin - apart.distance;
        if (is_known && missing > request.contact && missing > found.hit_missing) { found.hit = seen; found.hit_missing = missing; }
        item.near = largest(item.near, apart.proved);
        if (dot(apart.normal, apart.normal) > 0.0) {
            const Piece *a, *b;
            const Frame *fa, *fb;
            at.pieces(item.pair, a, fa, b, fb);
            item.in_first = fa->turned_back(apart.normal);
            item.in_second = fb->turned_back(apart.normal);
        }
        if (item.low() < enough - item.motion && enough - item.motion <= item.near)
            item.motion = smallest(item.motion, approach(item, apart.normal));
        return OK;
    }

    // Bound how much nearer a pair comes along a plane, to second order, see planner/scene/continuous.py.
    double approach(const Item& item, Vec normal) {
        const int64_t joints = scene.joints, obstacles = scene.obstacles();
        int64_t mover, standing = -1;
        Vec d = normal;
        if (item.pair < scene.own) {
            mover = scene.second[item.pair];
            standing = scene.first[item.pair];
            d = -normal;
        } else {
            mover = (item.pair - scene.own) / obstacles;
            const int64_t obstacle = (item.pair - scene.own) % obstacles;
            if (obstacle >= scene.boxes) d = -scene.plane[obstacle - scene.boxes].normal;
        }
        if (!(dot(d, d) > 0.0)) return INFINITY;
        if (!has_velocities) {
            motion.velocities(middle, v.data);
            excursions(motion, start, end, q.data, v.data, matrix.data, local.data, rest.data);
            has_velocities = true;
        }
        Vec angular{0.0, 0.0, 0.0}, linear{0.0, 0.0, 0.0};
        double second = 0.0, remainder = 0.0, beyond = 0.0, after = 0.0, far = 0.0;
        for (int64_t j = joints - 1; j >= 0; j--) {  // `beyond` and `after` sum up the joints after this one
            const Frame& frame = at.frame[j + 1];
            far = largest(far, extent(frame.origin));
            const bool moves = scene.moved[mover * joints + j], moves_other = standing >= 0 && scene.moved[standing * joints + j];
            if (moves_other && !moves) return INFINITY;
            if (!moves || moves_other) continue;
            const bool turns = scene.joint[j].turns != 0.0;
            const Vec axis = frame.column(2);
            if (turns) {
                angular = angular + v[j] * axis;
                linear = linear - v[j] * cross(axis, frame.origin);
            } else {
                linear = linear + v[j] * axis;
            }
            const double lever = at.levers[mover * joints + j], moved = lever * reach[j], later = reach[j] * (lever + beyond);
            if (turns) second += reach[j] * (later / 2.0 + after);
            remainder += lever * rest[j];
            beyond += moved;
            after += later;
        }
        const Points points = scene.all_points();
        const Piece& piece = scene.piece[mover];
        const Frame& own = at.frame[(int64_t)piece.joint];
        const double now = support(points, piece, own, d), half = (end - start) / 2.0;
        double first = -INFINITY;
        for (int side = -1; side <= 1; side += 2) {
            const double step = side * half;
            first = largest(first, step * dot(d, linear) + support(points, piece, own, d + step * cross(d, angular)) - now);
        }
        return first + second + remainder + 4.0 * RELATIVE_ROUNDING * (1.0 + far + piece.extent);
    }

    // Collect the pairs of a node that cheap bounds, and planes found before, leave too near.
    int collect(const Node& node) {
        items.count = 0;
        if (!node.items) return gather(at, wanted, 0.0, items, found.lower);
        for (int64_t i = 0; i < node.items->count; i++) {
            Item item = node.items->item[i];
            const double enough = wanted.of(item.kind, item.margin);
            if (item.pair < scene.own) {
                at.bound_own(item.pair, enough, item);
            } else {
                const int64_t body = (item.pair - scene.own) / scene.obstacles();
                at.place(body);
                item.motion = at.sums[body];
                item.near = at.bound(body, (item.pair - scene.own) % scene.obstacles(), enough + item.motion);
            }
            if (item.low() < enough && item.has_plane()) item.near = largest(item.near, at.plane_bound(item));
            if (item.low() >= enough) { lower(item); continue; }
            Item* place = items.push();
            if (!place) return NO_MEMORY;
            *place = item;
        }
        return OK;
    }

    // The rows of the items, the lowest bound first; of equal ones the first.
    bool sort() {
        List<int64_t>& rows = ordered;
        rows.count = 0;
        for (int64_t i = 0; i < items.count; i++) {
            if (!rows.push()) return false;
            int64_t k = rows.count - 1;  // a heap with the largest on top, which is taken apart below
            for (; k && is_lower(rows[(k - 1) / 2], i); k = (k - 1) / 2) rows[k] = rows[(k - 1) / 2];
            rows[k] = i;
        }
        for (int64_t left = rows.count - 1; left > 0; left--) {
            const int64_t top = rows[0], last = rows[left];
            int64_t k = 0, child;
            while ((child = 2 * k + 1) < left) {
                if (child + 1 < left && is_lower(rows[child], rows[child + 1])) child++;
                if (!is_lower(last, rows[child])) break;
                rows[k] = rows[child];
                k = child;
            }
            rows[k] = last;
            rows[left] = top;
        }
        return true;
    }
    bool is_lower(int64_t a, int64_t b) {
        const double x = items[a].low(), y = items[b].low();
        return x != y ? x < y : a < b;
    }

    int split(const Node& node) {
        int64_t left = 0, parts = 2;
        double urgency = INFINITY;
        for (int64_t i = 0; i < items.count; i++) {
            const Item& item = items[i];
            const double enough = wanted.of(item.kind, item.margin);
            if (item.low() >= enough) { lower(item); continue; }
            const double need = ceil(item.motion / largest(item.near - enough, 1e-9));
            if (need > (double)parts) parts = need < (double)MOST_SPLITS ? (int64_t)need : MOST_SPLITS;
            urgency = smallest(urgency, item.low() - enough);
            items[left++] = item;
        }
        if (!left) return OK;
        if (node.end - node.start < request.least_share * motion.end()) {
            for (int64_t i = 0; i < left; i++) { lower(items[i]); leave(items[i].near, middle, items[i].pair); }
            return OK;
        }
        Items* kept = static_cast<Items*>(malloc(sizeof(Items) + left * sizeof(Item)));
        if (!kept) return NO_MEMORY;
        kept->users = parts;
        kept->count = left;
        memcpy(kept->item, items.data, left * sizeof(Item));
        for (int64_t k = 0; k < parts; k++) {
            const double width = node.end - node.start;
            const double from = node.start + width * ((double)k / (double)parts);
            const double to = k + 1 == parts ? node.end : node.start + width * ((double)(k + 1) / (double)parts);
            if (push(from, to, urgency, kept)) {
                kept->users -= parts - k - 1;  // this one and those in the heap
                release(kept);
                return NO_MEMORY;
            }
        }
        return OK;
    }

    void leave(double distance, double time, int64_t pair) {
        if (found.undecided.pair < 0.0 || distance < found.undecided.distance) found.undecided = {distance, time, (double)pair};
    }

    int step(const Node& node) {
        put(node.start, node.end);
        found.positions += 1.0;
        for (int64_t j = 0; j < scene.joints; j++)
            if (!(q[j] - q[j] == 0.0 && reach[j] - reach[j] == 0.0)) { finish(node); return OK; }  // an overflow
        if (const int code = collect(node)) return code;
        if (!sort()) return NO_MEMORY;
        for (int64_t i = 0; i < items.count; i++) {
            Item& item = items[ordered[i]];
            const double enough = wanted.of(item.kind, item.margin);
            if (item.low() >= enough || item.motion / ENOUGH_PARTS <= item.near - enough) continue;
            if (!has_budget()) break;
            if (const int code = look(item)) return code;
            if (has_hit() && !is_measured()) return OK;
        }
        return split(node);
    }

    // Measure the pair with an obstacle of each kind that seems nearest in the middles of the first intervals.
    int look_ahead(int64_t parts) {
        Item best[KINDS] = {};
        double time[KINDS][2] = {};
        for (int64_t kind = 1; kind < KINDS; kind++) best[kind].near = INFINITY;
        for (int64_t part = 0; part < parts; part++) {
            const double from = motion.end() * part / parts, to = motion.end() * (part + 1) / parts;
            put(from, to);
            for (int64_t body = 0; body < scene.bodies; body++) {
                at.place(body);
                const Vec a = at.ends[2 * body], b = at.ends[2 * body + 1], centre = 0.5 * (a + b);
                const double radius = 0.5 * length(b - a) + scene.piece[body].capsule, most = largest(best[1].near, best[2].near);
                for (int64_t group = 0; group < scene.groups; group++) {
                    const int64_t begin = group ? scene.group_end[group - 1] : 0;
                    if (scene.member[begin] < scene.boxes && at.from_ball(centre, radius, scene.group[group]) >= most) continue;
                    for (int64_t k = begin; k < scene.group_end[group]; k++) {
                        const int64_t obstacle = scene.member[k], cell = body * scene.obstacles() + obstacle;
                        Item& least = best[scene.kind[cell]];
                        if (scene.margin[cell] == -INFINITY) continue;
                        if (obstacle < scene.boxes && at.from_ball(centre, radius, {scene.box[obstacle].frame.origin, scene.box[obstacle].sphere}) >= least.near) continue;
                        const double near = at.bound(body, obstacle, least.near);
                        if (near >= least.near) continue;
                        least = {scene.own + cell, scene.kind[cell], near, at.sums[body], scene.margin[cell], {}, {}};
                        time[least.kind][0] = from;
                        time[least.kind][1] = to;
                    }
                }
            }
        }
        for (int64_t kind = 1; kind < KINDS; kind++) {
            if (!(best[kind].near < INFINITY) || !has_budget()) continue;
            put(time[kind][0], time[kind][1]);
            at.place((best[kind].pair - scene.own) / scene.obstacles());
            if (const int code = look(best[kind])) return code;
        }
        return OK;
    }

    // Whether the motion is made of numbers: of others nothing is proved.
    bool is_finite() const {
        double sum = motion.end();
        const int64_t count = motion.pieces * motion.joints * motion.order;
        for (int64_t i = 0; i < count; i++) sum += motion.coefficients[i] - motion.coefficients[i];
        return sum - sum == 0.0;
    }

    int search() {
        const int64_t parts = is_finite() ? first_parts() : 1;
        for (int64_t k = 0; k < parts; k++) {
            const double from = motion.end() * k / parts, to = motion.end() * (k + 1) / parts;
            if (push(from, to, -INFINITY, nullptr)) return NO_MEMORY;
        }
        if (!is_finite()) return OK;
        if (is_measured())
            if (const int code = look_ahead(parts)) return code;
        while (nodes.count && has_budget() && (!has_hit() || (is_measured() && !nodes[0].items))) {
            const Node node = pop();
            const int code = step(node);
            release(node.items);
            if (code) return code;
        }
        return OK;
    }

    // How many intervals a motion is cut into at first: by how far its joints go, as far as samples tell.
    int64_t first_parts() {
        const int64_t most = (int64_t)request.parts;
        double ways = 0.0;
        for (int64_t j = 0; j < scene.joints; j++) v[j] = 0.0;
        motion.positions(0.0, q.data);
        for (int64_t k = 1; k <= most; k++) {
            memcpy(rest.data, q.data, scene.joints * sizeof(double));
            motion.positions(motion.end() * k / most, q.data);
            for (int64_t j = 0; j < scene.joints; j++) ways = largest(ways, v[j] += fabs(q[j] - rest[j]));
        }
        return (int64_t)clipped(ceil(ways / ARC_OF_PART), 1.0, (double)most);
    }

public:
    static constexpr double ARC_OF_PART = 0.15;  // of the fastest joint, rad or m, in one of the first intervals

    Proof(const Scene& scene, const Motion& motion, const Request& request, Frame* frames, Measure measure, Found& found)
        : scene(scene), motion(motion), request(request), measure(measure), found(found), at(scene, frames),
          wanted{request.contact, request.tolerance, {INFINITY, INFINITY, INFINITY}}, q(scene.joints), v(scene.joints),
          reach(scene.joints), rest(scene.joints), matrix(motion.order * motion.order), local(motion.order) {}

    int run() {
        if (!at || !q || !v || !reach || !rest || !matrix || !local) return NO_MEMORY;
        bernstein_matrix(motion.order, matrix.data);
        if (!is_measured()) for (double& upper : wanted.upper) upper = -INFINITY;
        for (int64_t kind = 0; kind < KINDS; kind++) { found.lower[kind] = INFINITY; found.nearest[kind] = {INFINITY, 0.0, -1.0}; }
        found.hit = found.undecided = {0.0, 0.0, -1.0};
        found.hit_missing = -INFINITY;
        found.positions = found.distances = 0.0;
        const int code = search();
        for (int64_t i = 0; i < nodes.count; i++) {  // what was not looked at may be as near as anything
            finish(nodes[i]);
            release(nodes[i].items);
        }
        return code;
    }

private:
    void finish(const Node& node) {
        const double time = (node.start + node.end) / 2.0;
        if (node.items) {
            for (int64_t i = 0; i < node.items->count; i++) {
                found.lower[node.items->item[i].kind] = -INFINITY;
                leave(-INFINITY, time, node.items->item[i].pair);
            }
            return;
        }
        if (scene.own) { found.lower[ITSELF] = -INFINITY; leave(-INFINITY, time, 0); }
        for (int64_t cell = 0; cell < scene.bodies * scene.obstacles(); cell++)
            if (scene.margin[cell] > -INFINITY) { found.lower[scene.kind[cell]] = -INFINITY; leave(-INFINITY, time, scene.own + cell); }
    }
};
