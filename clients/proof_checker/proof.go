package main

import (
	"math"
	"math/big"
	"sort"
)

const format = "planner-proof/4"

var (
	parts          = []string{"statement", "trajectory", "evidence"}
	jointClaims    = []string{"position", "velocity", "acceleration", "jerk"}
	torqueClaims   = []string{"torque", "power", "total_power", "torque_at_speed"}
	boundedClaims  = append(append(append(torqueClaims, atSpeedClaims[1:]...), "path_deviation", "tool_pose"), toolClaims...)
	distanceClaims = []string{"clearance", "speed_zones"}
	exactExcess    = big.NewRat(1_000_000_001, 1_000_000_000) // factor on limits of the joints
	boundedExcess  = 1e-6                                     // relative, over limits of torque, power and the tool
	jump           = big.NewRat(1, 10_000_000)                // of a derivative, relative to its largest value
	miss           = big.NewRat(1, 1_000_000)                 // distance of a joint from its waypoint
)

type scene struct {
	shapes []shape
	pairs  map[string][]pair // by claim
}

// A pair of shapes is to be apart by a margin, or the robot is to be slow, if the pair has a speed.
type pair struct {
	one, other    int
	margin, speed float64
	hasSpeed      bool
}

type proof struct {
	statement, evidence any
	digests             map[string]string
	claims, notCovered  []string
	claimed             map[string]bool
	lengths, begins     []*big.Rat
	rows                [][][]float64
	pieces, joints      int
	segment             []int
	segments            int
	robots              []robot
	scenes              []scene
	paths               []*path       // of segments, or nil
	kept                [][]condition // of segments
	atSpeed             map[string][][][]line
	robotOf, sceneOf    []int
	hulls               map[[2]int][]float64
}

func readProof(content any) *proof {
	require(text(field(content, "format")) == format, "the format is not "+format)
	p := &proof{statement: field(content, "statement"), evidence: field(content, "evidence")}
	p.digests, p.claimed, p.hulls = map[string]string{}, map[string]bool{}, map[[2]int][]float64{}
	given := field(content, "digests")
	require(len(given.(map[string]any)) == len(parts), "a digest is missing")
	for _, name := range parts {
		p.digests[name] = digest(field(content, name))
		require(text(field(given, name)) == p.digests[name], "a digest does not match")
	}
	p.readTrajectory(field(content, "trajectory"))
	known := map[string]bool{"continuity": true, "waypoints": true, "velocity_at_position": true}
	for _, names := range [][]string{jointClaims, boundedClaims, distanceClaims} {
		for _, name := range names {
			known[name] = true
		}
	}
	for _, each := range list(field(p.statement, "claims")) {
		name := text(each)
		require(known[name] && !p.claimed[name], "a claim is unknown")
		p.claimed[name] = true
		p.claims = append(p.claims, name)
	}
	for _, each := range list(field(p.statement, "not_covered")) {
		p.notCovered = append(p.notCovered, text(each))
	}
	for _, each := range list(field(p.statement, "robots")) {
		p.robots = append(p.robots, readRobot(each, p.joints))
	}
	for _, each := range list(field(p.statement, "scenes")) {
		p.scenes = append(p.scenes, p.readScene(each))
	}
	for _, each := range list(field(p.statement, "robot_of_segment")) {
		p.robotOf = append(p.robotOf, index(each, len(p.robots)))
	}
	for _, each := range list(field(p.statement, "scene_of_segment")) {
		p.sceneOf = append(p.sceneOf, index(each, len(p.scenes)))
	}
	fits := len(p.sceneOf) == 0 || len(p.sceneOf) == p.segments
	require(len(p.robotOf) == p.segments && fits, "a segment has no robot")
	limits := field(p.statement, "limits")
	if p.claimed["path_deviation"] {
		for _, each := range list(field(limits, "path_deviation")) {
			var found *path
			if each != nil {
				found = readPath(each)
			}
			p.paths = append(p.paths, found)
		}
	}
	if p.claimed["tool_pose"] {
		for _, each := range list(field(limits, "tool_pose")) {
			p.kept = append(p.kept, readConditions(each))
		}
	}
	p.atSpeed = map[string][][][]line{}
	for _, name := range atSpeedClaims {
		if p.claimed[name] {
			p.atSpeed[name] = p.readLines(field(limits, name))
		}
	}
	return p
}

func (p *proof) readTrajectory(value any) {
	p.begins = []*big.Rat{none}
	for _, length := range numbers(field(value, "lengths"), -1) {
		require(length > 0, "a piece has no length")
		p.lengths = append(p.lengths, rat(length))
		p.begins = append(p.begins, sum(p.begins[len(p.begins)-1], rat(length)))
	}
	p.pieces = len(p.lengths)
	rows := list(field(value, "coefficients"))
	require(len(rows) == p.pieces && p.pieces > 0, "a piece is malformed")
	order := -1
	for i, piece := range rows {
		var found [][]float64
		for _, row := range list(piece) {
			if order < 0 {
				order = len(list(row))
			}
			found = append(found, numbers(row, order))
		}
		require(i == 0 || len(found) == p.joints, "a piece is malformed")
		p.joints = len(found)
		p.rows = append(p.rows, found)
	}
	require(order > 0 && order <= 16, "a piece is malformed")
	last := 0
	p.segments = index(field(p.statement, "segments"), 1<<30)
	for _, each := range list(field(value, "segments")) {
		found := index(each, p.segments)
		require(found >= last, "segments are out of order")
		last = found
		p.segment = append(p.segment, found)
	}
	require(len(p.segment) == p.pieces, "segments are malformed")
}

func (p *proof) readScene(value any) scene {
	s := scene{pairs: map[string][]pair{}}
	for _, each := range list(field(value, "shapes")) {
		s.shapes = append(s.shapes, readShape(each, p.joints))
	}
	for _, name := range distanceClaims {
		if !p.claimed[name] {
			continue
		}
		for _, each := range list(field(value, name)) {
			row := list(each)
			require(len(row) == 3 && name == "clearance" || len(row) == 4 && name != "clearance", "a pair is malformed")
			found := pair{one: index(row[0], len(s.shapes)), other: index(row[1], len(s.shapes)), margin: number(row[2])}
			if len(row) == 4 {
				found.speed, found.hasSpeed = number(row[3]), true
			}
			s.pairs[name] = append(s.pairs[name], found)
		}
	}
	return s
}

func (p *proof) derivative(piece, joint, order int) []*big.Rat {
	return derivative(exact(p.rows[piece][joint]), p.lengths[piece], order)
}

func (p *proof) check() {
	p.checkContinuity()
	p.checkWaypoints()
	for order, name := range jointClaims {
		if p.claimed[name] {
			p.checkJoints(name, order)
		}
	}
	if p.claimed["velocity_at_position"] {
		p.checkVelocityAtPosition()
	}
	for _, name := range boundedClaims {
		if p.claimed[name] {
			p.checkBounded()
			break
		}
	}
	for _, name := range distanceClaims {
		if p.claimed[name] {
			p.checkDistances(name)
		}
	}
}

func (p *proof) checkContinuity() {
	if !p.claimed["continuity"] {
		return
	}
	ends := field(p.statement, "ends")
	for order := 0; order <= index(field(p.statement, "continuity"), 5); order++ {
		largest := new(big.Rat)
		before := list(list(field(ends, "initial"))[order])
		after := list(list(field(ends, "final"))[order])
		require(len(before) == p.joints && len(after) == p.joints, "an end has another number of joints")
		worst := new(big.Rat)
		for j := 0; j < p.joints; j++ {
			last := rat(number(before[j]))
			for i := 0; i <= p.pieces; i++ {
				next := rat(number(after[j]))
				var row []*big.Rat
				if i < p.pieces {
					row = p.derivative(i, j, order)
					next = row[0]
				}
				if gap := size(sum(next, minus(last))); gap.Cmp(worst) > 0 {
					worst = gap
				}
				if i < p.pieces {
					last = value(row, one)
					bounds, common := bernstein(row)
					for _, c := range bounds {
						if s := new(big.Rat).SetFrac(new(big.Int).Abs(c), common); s.Cmp(largest) > 0 {
							largest = s
						}
					}
				}
			}
		}
		require(worst.Cmp(product(jump, largest)) <= 0, "a derivative of the position jumps")
	}
}

func (p *proof) checkWaypoints() {
	if !p.claimed["waypoints"] {
		return
	}
	last := new(big.Rat)
	for _, each := range list(field(p.statement, "waypoints")) {
		time := rat(number(field(each, "time")))
		end := product(p.begins[p.pieces], exactExcess)
		require(last.Cmp(time) <= 0 && time.Cmp(end) <= 0, "the times of the waypoints are out of order")
		last = time
		piece := sort.Search(p.pieces, func(i int) bool { return p.begins[i].Cmp(time) > 0 }) - 1
		share := quotient(sum(time, minus(p.begins[piece])), p.lengths[piece])
		if share.Cmp(one) > 0 {
			share = one
		}
		if given := field(each, "position"); given != nil {
			for j, position := range numbers(given, p.joints) {
				apart := size(sum(value(p.derivative(piece, j, 0), share), minus(rat(position))))
				require(apart.Cmp(miss) <= 0, "a waypoint is missed")
			}
		}
		arm := &p.robots[index(field(each, "robot"), len(p.robots))]
		if conditions := readConditions(field(each, "tool_pose")); len(conditions) > 0 {
			require(p.onPiece(arm, piece, share, share).keeps(conditions), "the tool misses the pose of a waypoint")
		}
	}
}

// room returns limit - sign p, with a limit that is widened by rounding.
func room(p []*big.Rat, limit float64, sign int64) []*big.Rat {
	widened := rat(limit)
	widened.Add(widened, product(size(widened), sum(exactExcess, minus(one))))
	found := make([]*big.Rat, len(p))
	for k, c := range p {
		found[k] = product(big.NewRat(-sign, 1), c)
	}
	found[0] = sum(found[0], widened)
	return found
}

func (p *proof) checkJoints(name string, order int) {
	limits := list(field(field(p.statement, "limits"), name))
	for i := range p.rows {
		sides := list(limits[p.segment[i]])
		require(len(sides) == 2, "a limit has two sides")
		for j := 0; j < p.joints; j++ {
			row := p.derivative(i, j, order)
			if most := limitOf(list(sides[1])[j]); most.known {
				require(isOneNonnegative(room(row, most.value, 1)), "the "+name+" of a joint exceeds its limit")
			}
			if least := limitOf(list(sides[0])[j]); least.known {
				require(isOneNonnegative(room(row, -least.value, -1)), "the "+name+" of a joint exceeds its limit")
			}
		}
	}
}

func scaled(p []*big.Rat, by *big.Rat) []*big.Rat {
	found := make([]*big.Rat, len(p))
	for k, c := range p {
		found[k] = product(c, by)
	}
	return found
}

func (p *proof) checkVelocityAtPosition() {
	limits := field(p.statement, "limits")
	curves := list(field(limits, "velocity_at_position"))
	scales := numbers(field(limits, "velocity_scale"), p.segments)
	for i := range p.rows {
		scale := product(rat(scales[p.segment[i]]), exactExcess)
		require(scale.Sign() > 0, "a scale is not positive")
		for j := 0; j < p.joints; j++ {
			for _, curve := range list(curves[j]) {
				sign := one
				if field(curve, "towards") == "lower" {
					sign = minus(one)
				}
				position := scaled(p.derivative(i, j, 0), sign)
				speed := scaled(p.derivative(i, j, 1), quotient(sign, scale))
				c := exact(numbers(field(curve, "coefficients"), 4))
				allowed := make([]*big.Rat, len(position)+len(speed))
				for k := range allowed {
					allowed[k] = new(big.Rat)
				}
				for k, x := range position {
					allowed[k].Add(allowed[k], product(c[3], x))
				}
				for k, x := range speed {
					allowed[k].Sub(allowed[k], product(c[1], x))
					for l, y := range speed {
						allowed[k+l].Sub(allowed[k+l], product(c[0], product(x, y)))
					}
				}
				allowed[0].Add(allowed[0], c[2])
				slow := scaled(speed, minus(one))
				slow[0] = sum(slow[0], big.NewRat(1, 1_000_000_000))
				choices := [][]*big.Rat{allowed, slow}
				if low := limitOf(field(curve, "low")); low.known {
					below := scaled(position, minus(one))
					below[0] = sum(below[0], rat(low.value))
					choices = append(choices, below)
				}
				if high := limitOf(field(curve, "high")); high.known {
					above := scaled(position, one)
					above[0] = sum(above[0], minus(rat(high.value)))
					choices = append(choices, above)
				}
				require(isOneNonnegative(choices...), "a joint is too fast for its position")
			}
		}
	}
}

// onPiece returns the motion on a part of a piece, given by shares of it.
func (p *proof) onPiece(arm *robot, piece int, start, end *big.Rat) *motion {
	half := big.NewRat(1, 2)
	middle := product(product(sum(start, end), half), p.lengths[piece])
	reach := product(product(sum(end, minus(start)), half), p.lengths[piece])
	var found [4][]model
	for _, row := range p.rows[piece] {
		for order, coefficients := range taylor(exact(row), middle, reach) {
			found[order] = append(found[order], modelOf(coefficients))
		}
	}
	return newMotion(arm, found[0], found[1:]...)
}

// split returns the number of a piece and the share of it of a time.
func split(time float64, piece int) *big.Rat {
	return sum(rat(time), minus(big.NewRat(int64(piece), 1)))
}

// span returns the first and the last piece of an interval.
func (p *proof) span(start, end float64) (int, int) {
	require(0 <= start && start < end && end <= float64(p.pieces), "an interval is out of range")
	first := int(start)
	last := int(math.Ceil(end)) - 1
	if last > first {
		require(start == float64(first) && end == float64(last+1), "an interval of several pieces ends within one")
	}
	return first, last
}

func (p *proof) checkBounded() {
	ends := numbers(field(p.evidence, "bounded"), -1)
	require(len(ends) > 1 && ends[0] == 0 && ends[len(ends)-1] == float64(p.pieces), "a piece is not covered")
	along := list(field(p.evidence, "along"))
	require(len(along) == 0 || len(along) == len(ends)-1, "an interval has no share of the path")
	for i := 1; i < len(ends); i++ {
		first, last := p.span(ends[i-1], ends[i])
		require(first == last, "an interval has several pieces")
		start, end := split(ends[i-1], first), split(ends[i], first)
		var where any
		if len(along) > 0 {
			where = along[i-1]
		}
		segment := p.segment[first]
		m := p.onPiece(&p.robots[p.robotOf[segment]], first, start, end)
		isBounded := p.isBoundedOn(m, segment) && p.isBelowLines(m, segment)
		require(isBounded && p.isGuidedOn(m, segment, where), "a limit is not proved")
	}
}

// isGuidedOn tells whether the tool keeps to its path, and keeps the conditions on its pose.
//
// The tool is near the path at shares of it, a polynomial, or in the blend of a number.
func (p *proof) isGuidedOn(m *motion, segment int, where any) bool {
	if p.claimed["path_deviation"] && p.paths[segment] != nil {
		path := p.paths[segment]
		_, isPolynomial := where.([]any)
		if isPolynomial {
			row := list(where)
			require(len(row) == 7, "a share is malformed")
			on := &path.guides[index(row[0], len(path.guides))]
			if !m.isOn(path, on, modelOf(numbers(row[1:], 6))) {
				return false
			}
		}
		if !isPolynomial {
			number := index(where, len(path.blends))
			if !m.keeps(path.blends[number : number+1]) {
				return false
			}
		}
	}
	return !p.claimed["tool_pose"] || m.keeps(p.kept[segment])
}

func (p *proof) isBoundedOn(m *motion, segment int) bool {
	limits := field(p.statement, "limits")
	own := func(name string) any { return list(field(limits, name))[segment] }
	fits := true
	below := func(value model, most limit) {
		fits = fits && (!most.known || value.isBelow(most.value+boundedExcess*math.Abs(most.value)))
	}
	between := func(name string, values []model) {
		if !p.claimed[name] {
			return
		}
		sides := list(own(name))
		require(len(sides) == 2, "a limit has two sides")
		lower, upper := list(sides[0]), list(sides[1])
		require(len(lower) == len(values) && len(upper) == len(values), "a limit is missing")
		for k, value := range values {
			least := limitOf(lower[k])
			below(value, limitOf(upper[k]))
			below(value.times(-1), limit{-least.value, least.known})
		}
	}
	if p.claimed["torque"] || p.claimed["power"] || p.claimed["total_power"] {
		torques, total := m.actual().torques(), model{}
		powers := make([]model, len(torques))
		for j, torque := range torques {
			powers[j] = multiply(torque, m.v[j])
			total = plus(total, powers[j])
		}
		between("torque", torques)
		between("power", powers)
		between("total_power", []model{total})
	}
	var squares map[string]model
	for _, name := range toolClaims {
		if p.claimed[name] {
			if squares == nil {
				squares = m.actual().toolSquares()
			}
			most := limitOf(own(name))
			below(squares[name], limit{most.value * math.Abs(most.value), most.known})
		}
	}
	return fits
}

// hull returns the Bernstein coefficients of a joint's position on a piece, rounded.
func (p *proof) hull(piece, joint int) []float64 {
	key := [2]int{piece, joint}
	if found, ok := p.hulls[key]; ok {
		return found
	}
	var found []float64
	row, common := bernstein(p.derivative(piece, joint, 0))
	for _, c := range row {
		x, _ := new(big.Rat).SetFrac(c, common).Float64()
		require(!math.IsInf(x, 0), "a position is too large")
		found = append(found, x)
	}
	p.hulls[key] = found
	return found
}

// chord returns the model of a joint's position on several pieces: a straight line and its largest error.
func (p *proof) chord(joint, first, last int) model {
	begin := p.begins[first]
	whole := sum(p.begins[last+1], minus(begin))
	at := func(piece int) float64 {
		x, _ := quotient(sum(p.begins[piece], minus(begin)), whole).Float64()
		return x
	}
	low := p.hull(first, joint)[0]
	end := p.hull(last, joint)
	rise := end[len(end)-1] - low
	worst, largest := 0.0, 0.0
	for piece := first; piece <= last; piece++ {
		row := p.hull(piece, joint)
		start, stop := at(piece), at(piece+1)
		for k, c := range row {
			x := start
			if len(row) > 1 {
				x += (stop - start) * (float64(k) / float64(len(row)-1))
			}
			worst = math.Max(worst, math.Abs(c-low-rise*x))
			largest = math.Max(largest, math.Abs(c))
		}
	}
	m := constant(low + rise/2)
	m.p[1] = rise / 2
	m.r = worst + 1e-14*largest + tiny
	return m
}

func (p *proof) onSeveral(first, last int) *motion {
	robotNumber, sceneNumber := p.robotOf[p.segment[first]], p.sceneOf[p.segment[first]]
	for _, segment := range p.segment[first : last+1] {
		same := p.robotOf[segment] == robotNumber && p.sceneOf[segment] == sceneNumber
		require(same, "an interval has two robots or scenes")
	}
	q := make([]model, p.joints)
	for j := range q {
		q[j] = p.chord(j, first, last)
	}
	return newMotion(&p.robots[robotNumber], q)
}

// checkDistances checks that at all times a plane keeps each pair of shapes apart, or the robot is slow.
func (p *proof) checkDistances(name string) {
	require(len(p.sceneOf) > 0, "a segment has no scene")
	var begins, ends []int // of pieces with the same scene and robot
	for k := range p.segment {
		if k == 0 || p.sceneOf[p.segment[k]] != p.sceneOf[p.segment[k-1]] || p.robotOf[p.segment[k]] != p.robotOf[p.segment[k-1]] {
			begins = append(begins, k)
			ends = append(ends, k)
		}
		ends[len(ends)-1] = k + 1
	}
	reached := map[[2]int]float64{}
	for _, each := range list(field(p.evidence, name)) {
		node := list(each)
		require(len(node) == 3, "an interval is malformed")
		start, end := number(node[0]), number(node[1])
		first, last := p.span(start, end)
		segment := p.segment[first]
		var m *motion
		if first == last {
			m = p.onPiece(&p.robots[p.robotOf[segment]], first, split(start, first), split(end, first))
		} else {
			m = p.onSeveral(first, last)
		}
		s := &p.scenes[p.sceneOf[segment]]
		for _, plane := range list(node[2]) {
			row := list(plane)
			require(len(row) == 2, "a plane is malformed")
			number := index(row[0], len(s.pairs[name]))
			require(m.isSafe(s, &s.pairs[name][number], row[1]), "not proved: "+name)
			stretch := sort.Search(len(begins), func(i int) bool { return begins[i] > first }) - 1
			key := [2]int{stretch, number}
			before, known := reached[key]
			if !known {
				before = float64(begins[stretch])
			}
			require(start == before && end <= float64(ends[stretch]), "there is a gap or an overlap")
			reached[key] = end
		}
	}
	require(len(reached) > 0, name+" has no pairs")
	for stretch, begin := range begins {
		for number := range p.scenes[p.sceneOf[p.segment[begin]]].pairs[name] {
			require(reached[[2]int{stretch, number}] == float64(ends[stretch]), name+" lacks evidence")
		}
	}
}
