package main

import "math"

type link struct {
	rotation, inertia [3][3]float64
	origin, center    [3]float64
	mass              float64
	turns             bool
	friction, damping float64
	rotor             float64 // inertia
}

// A robot, or a mechanism that carries the tool along its path.
type robot struct {
	links    []link
	gravity  [3]float64
	joint    int // that carries the tool
	rotation [3][3]float64
	point    [3]float64

	process       int // the joint in whose axes the tool exerts force and moment
	force, moment [3]float64

	following []float64 // largest distances of the joints from their planned positions
}

// readMechanism reads links without their dynamics, and a tool.
func readMechanism(value any) robot {
	var r robot
	for _, each := range list(field(value, "links")) {
		r.links = append(r.links, link{
			rotation: matrix3(field(each, "rotation")),
			origin:   vector3(field(each, "origin")),
			turns:    field(each, "motion") == "revolute",
		})
	}
	tool := field(value, "tool")
	r.joint = index(field(tool, "joint"), len(r.links)+1)
	r.rotation = matrix3(field(tool, "rotation"))
	r.point = vector3(field(tool, "translation"))
	return r
}

func readRobot(value any, joints int) robot {
	r := readMechanism(value)
	require(len(r.links) == joints, "a robot has another number of joints")
	for k, each := range list(field(value, "links")) {
		l := &r.links[k]
		l.inertia, l.center = matrix3(field(each, "inertia")), vector3(field(each, "center_of_mass"))
		l.mass, l.rotor = number(field(each, "mass")), number(field(each, "rotor_inertia"))
		l.friction, l.damping = number(field(each, "friction")), number(field(each, "damping"))
	}
	r.gravity = vector3(field(value, "gravity"))
	process := list(field(value, "process_force"))
	require(len(process) == 3, "a process force is malformed")
	r.process = index(process[0], r.joint+1)
	r.force, r.moment = vector3(process[1]), vector3(process[2])
	r.following = numbers(field(value, "following_errors"), joints)
	return r
}

// A guide is a mechanism that follows a part of a path. Its joints are polynomials of the share of the part, without
// constants.
type guide struct {
	robot
	rates [][]float64 // of each joint, by powers of the share
}

// A path of the tool.
type path struct {
	guides    []guide
	tolerance []float64 // squares of the distances of position and of rotation matrix
	blends    []condition
}

func readPath(value any) *path {
	p := &path{}
	for _, each := range list(field(value, "guides")) {
		found := guide{robot: readMechanism(each)}
		for _, rates := range list(field(each, "rates")) {
			found.rates = append(found.rates, numbers(rates, -1))
		}
		require(len(found.rates) == len(found.links), "a joint of a guide has no rates")
		p.guides = append(p.guides, found)
	}
	p.tolerance = numbers(field(value, "tolerance"), -1)
	p.blends = readConditions(field(value, "blends"))
	return p
}

// A condition limits the sum of a value and of squares of values, each linear in 1, the tool's position and rotation.
type condition struct {
	linear  []float64
	squared [][]float64
	limit   float64
}

func readConditions(value any) (found []condition) {
	for _, each := range list(value) {
		row := list(each)
		require(len(row) == 3, "a condition is malformed")
		c := condition{linear: numbers(row[0], 13), limit: number(row[2])}
		for _, weights := range list(row[1]) {
			c.squared = append(c.squared, numbers(weights, 13))
		}
		found = append(found, c)
	}
	return found
}

// A frame has a rotation, row by row, and an origin.
type frame struct {
	rows   [3]vector
	origin vector
}

// A motion has the models of all joints on one interval.
type motion struct {
	robot          *robot
	q, v, a, j     []model
	sines, cosines []model
	known          map[int][]frame
	moving         []rate
	within         *motion // all motions within the following errors
	fastest        float64 // of all points; 0: unknown
}

// newMotion returns the motion of joint positions q and, if they are known, their first three derivatives.
func newMotion(r *robot, q []model, rates ...[]model) *motion {
	m := &motion{robot: r, q: q, known: map[int][]frame{}}
	if len(rates) > 0 {
		m.v, m.a, m.j = rates[0], rates[1], rates[2]
	}
	for k, each := range r.links {
		sine, cosine := model{}, constant(1)
		if each.turns {
			sine, cosine = turnOf(q[k])
		}
		m.sines, m.cosines = append(m.sines, sine), append(m.cosines, cosine)
	}
	return m
}

// actual returns the motion at all positions of the joints within their following errors.
func (m *motion) actual() *motion {
	if m.within == nil {
		m.within = m
		q := append([]model{}, m.q...)
		for k, x := range m.robot.following {
			if x != 0 {
				q[k].r = (q[k].r + math.Abs(x)) * up
				m.within = nil
			}
		}
		if m.within == nil {
			m.within = newMotion(m.robot, q, m.v, m.a, m.j)
		}
	}
	return m.within
}

// shift returns the origin of a joint's frame in the frame before.
func (m *motion) shift(k int) vector {
	each := &m.robot.links[k]
	found := constants(each.origin)
	if !each.turns {
		for i := range found {
			found[i] = plus(found[i], m.q[k].times(each.rotation[i][2]))
		}
	}
	return found
}

// outward turns a vector of the frame before into the frame of a joint.
func (m *motion) outward(k int, a vector) vector {
	a = apply(transposed(m.robot.links[k].rotation), a)
	if !m.robot.links[k].turns {
		return a
	}
	c, s := m.cosines[k], m.sines[k]
	return vector{
		plus(multiply(c, a[0]), multiply(s, a[1])),
		minusModel(multiply(c, a[1]), multiply(s, a[0])),
		a[2],
	}
}

// inward turns a vector of the frame of a joint into the frame before.
func (m *motion) inward(k int, a vector) vector {
	if m.robot.links[k].turns {
		c, s := m.cosines[k], m.sines[k]
		a = vector{
			minusModel(multiply(c, a[0]), multiply(s, a[1])),
			plus(multiply(c, a[1]), multiply(s, a[0])),
			a[2],
		}
	}
	return apply(m.robot.links[k].rotation, a)
}

// frames returns the frames from one on, all in that one.
func (m *motion) frames(start int) []frame {
	if found, ok := m.known[start]; ok {
		return found
	}
	at := frame{}
	for i := range at.rows {
		at.rows[i][i] = constant(1)
	}
	found := []frame{at}
	for k := start; k < len(m.robot.links); k++ {
		shift := m.shift(k)
		next := frame{}
		for i, row := range at.rows {
			next.origin[i] = at.origin[i]
			for j := range row {
				next.origin[i] = plus(next.origin[i], multiply(row[j], shift[j]))
			}
			next.rows[i] = m.outward(k, row)
		}
		found = append(found, next)
		at = next
	}
	m.known[start] = found
	return found
}

// A rate has the linear and angular velocity and acceleration of a frame, in its own axes.
type rate struct{ v, a, w, dw, gravity vector }

func (m *motion) rates() []rate {
	if m.moving != nil {
		return m.moving
	}
	at := rate{gravity: constants(m.robot.gravity)}
	found := []rate{at}
	for k, each := range m.robot.links {
		shift := m.shift(k)
		next := rate{
			v:  m.outward(k, plusVector(at.v, cross(at.w, shift))),
			a:  m.outward(k, plusVector(at.a, plusVector(cross(at.dw, shift), cross(at.w, cross(at.w, shift))))),
			w:  m.outward(k, at.w),
			dw: m.outward(k, at.dw),

			gravity: m.outward(k, at.gravity),
		}
		across := vector{multiply(next.w[1], m.v[k]), multiply(next.w[0], m.v[k]).times(-1), model{}}
		if each.turns {
			next.dw = plusVector(next.dw, across)
			next.dw[2] = plus(next.dw[2], m.a[k])
			next.w[2] = plus(next.w[2], m.v[k])
		} else {
			next.a = plusVector(next.a, across.times(2))
			next.a[2] = plus(next.a[2], m.a[k])
			next.v[2] = plus(next.v[2], m.v[k])
		}
		found = append(found, next)
		at = next
	}
	m.moving = found
	return found
}

// torques returns the torques or forces of the joints: the recursive Newton-Euler algorithm.
func (m *motion) torques() []model {
	rates := m.rates()
	found := make([]model, len(m.robot.links))
	var force, moment vector
	axes := m.frames(m.robot.process)[m.robot.joint-m.robot.process].rows
	for k := len(m.robot.links) - 1; k >= 0; k-- {
		if k+1 == m.robot.joint {
			var thrust, torsion vector
			for i := range thrust {
				column := vector{axes[0][i], axes[1][i], axes[2][i]}
				thrust[i], torsion[i] = dot(column, m.robot.force), dot(column, m.robot.moment)
			}
			force = plusVector(force, thrust)
			moment = plusVector(moment, plusVector(torsion, cross(constants(m.robot.point), thrust)))
		}
		each, at := &m.robot.links[k], rates[k+1]
		center := constants(each.center)
		push := plusVector(plusVector(at.a, at.gravity.times(-1)), plusVector(cross(at.dw, center), cross(at.w, cross(at.w, center)))).times(each.mass)
		spin := plusVector(apply(each.inertia, at.dw), cross(at.w, apply(each.inertia, at.w)))
		moment = plusVector(moment, plusVector(spin, cross(center, push)))
		force = plusVector(force, push)
		if each.turns {
			found[k] = moment[2]
		} else {
			found[k] = force[2]
		}
		found[k] = plus(found[k], plus(m.a[k].times(each.rotor), m.v[k].times(each.damping)))
		found[k] = plus(found[k], signOf(m.v[k]).times(each.friction))
		force, moment = m.inward(k, force), m.inward(k, moment)
		moment = plusVector(moment, cross(m.shift(k), force))
	}
	return found
}

var toolClaims = []string{
	"tcp_linear_velocity", "tcp_angular_velocity", "tcp_linear_acceleration", "tcp_angular_acceleration",
}

// toolSquares returns the squares of the tool's velocities and accelerations.
func (m *motion) toolSquares() map[string]model {
	at := m.rates()[m.robot.joint]
	point := constants(m.robot.point)
	linear := plusVector(at.v, cross(at.w, point))
	gain := plusVector(at.a, plusVector(cross(at.dw, point), cross(at.w, cross(at.w, point))))
	found := map[string]model{}
	for i, each := range []vector{linear, at.w, gain, at.dw} {
		found[toolClaims[i]] = squareOf(each)
	}
	return found
}

// tool returns the position of the tool and the rows of its rotation.
func (m *motion) tool() (vector, [3]vector) {
	at := m.frames(0)[m.robot.joint]
	var point vector
	var rows [3]vector
	for i, row := range at.rows {
		point[i] = plus(at.origin[i], dot(row, m.robot.point))
		rows[i] = apply(transposed(m.robot.rotation), row)
	}
	return point, rows
}

// keeps tells whether the tool keeps conditions on its pose.
func (m *motion) keeps(conditions []condition) bool {
	if len(conditions) == 0 {
		return true
	}
	point, rows := m.tool()
	pose := append([]model{constant(1)}, point[:]...)
	for _, row := range rows {
		pose = append(pose, row[:]...)
	}
	weighted := func(weights []float64) model {
		found := model{}
		for k, w := range weights {
			found = plus(found, pose[k].times(w))
		}
		return found
	}
	for _, each := range conditions {
		value := weighted(each.linear)
		for _, weights := range each.squared {
			root := weighted(weights)
			value = plus(value, multiply(root, root))
		}
		if !value.isBelow(each.limit) {
			return false
		}
	}
	return true
}

// isOn tells whether the tool is near a part of its path at shares of it.
func (m *motion) isOn(p *path, g *guide, share model) bool {
	if !share.isBelow(1+boundedExcess) || !share.times(-1).isBelow(boundedExcess) {
		return false
	}
	q := make([]model, len(g.rates))
	for k, rates := range g.rates {
		power := constant(1)
		for _, rate := range rates {
			power = multiply(power, share)
			q[k] = plus(q[k], power.times(rate))
		}
	}
	point, rows := m.tool()
	there, axes := newMotion(&g.robot, q).tool()
	squares := []model{squareOf(plusVector(point, there.times(-1))), {}}
	for i, row := range rows {
		squares[1] = plus(squares[1], squareOf(plusVector(row, axes[i].times(-1))))
	}
	for k, square := range squares {
		if k < len(p.tolerance) && !square.isBelow(p.tolerance[k]) {
			return false
		}
	}
	return true
}
