package main

import "math"

// A shape is the hull of points, over which a disc across an axis and a ball roll; or a half space.
type shape struct {
	joint              int
	points             [][3]float64
	axis, normal       [3]float64
	disc, ball, offset float64
	isHalfSpace        bool
}

func readShape(value any, joints int) shape {
	if has(value, "offset") {
		index(field(value, "joint"), 1)
		return shape{normal: vector3(field(value, "normal")), offset: number(field(value, "offset")), isHalfSpace: true}
	}
	s := shape{joint: index(field(value, "joint"), joints+1), axis: vector3(field(value, "axis"))}
	s.disc, s.ball = number(field(value, "disc")), number(field(value, "ball"))
	require(s.disc >= 0 && s.ball >= 0, "a radius is negative")
	require(math.Abs(math.Sqrt(inner(s.axis, s.axis))-1) < 1e-9, "an axis is no unit vector")
	for _, point := range list(field(value, "points")) {
		s.points = append(s.points, vector3(point))
	}
	require(len(s.points) > 0, "a shape has no points")
	return s
}

func inner(a, b [3]float64) float64 { return a[0]*b[0] + a[1]*b[1] + a[2]*b[2] }

// reach returns an upper bound of n . x over a shape.
func (s *shape) reach(n [3]float64, size float64) float64 {
	pad, most := 1e-14*size, math.Inf(-1)
	for _, x := range s.points {
		most = math.Max(most, inner(n, x)+pad*(math.Abs(x[0])+math.Abs(x[1])+math.Abs(x[2])))
	}
	along := math.Max(math.Abs(inner(n, s.axis))-4*pad, 0)
	disc := s.disc * math.Sqrt(math.Max(size*size*up-along*along, 0))
	return most + (s.ball*size+disc)*up
}

// isSafe tells whether a plane keeps a pair apart, or the robot is slow enough for its speed zone.
func (m *motion) isSafe(s *scene, p *pair, evidence any) bool {
	if evidence == "slow" {
		require(p.hasSpeed, "a pair has no speed")
		return m.topSpeed(s) <= p.speed*(1+boundedExcess)
	}
	first := &s.shapes[p.one]
	normal := first.normal
	if !first.isHalfSpace {
		normal = vector3(evidence)
	}
	return m.keepsApart(first, &s.shapes[p.other], normal, p.margin)
}

// topSpeed returns an upper bound of the speeds of a scene's moving shapes and of the tool centre point.
func (m *motion) topSpeed(s *scene) float64 {
	if m.fastest > 0 {
		return m.fastest
	}
	tool := shape{joint: m.robot.joint, points: [][3]float64{m.robot.point}}
	for _, each := range append([]shape{tool}, s.shapes...) {
		if each.joint == 0 {
			continue
		}
		at := m.rates()[each.joint]
		radius := (each.disc + each.ball) * lengthOf(at.w) * up
		for _, x := range each.points {
			m.fastest = math.Max(m.fastest, lengthOf(plusVector(at.v, cross(at.w, constants(x))))+radius)
		}
	}
	return m.fastest
}

// lengthOf returns an upper bound of the length of a vector.
func lengthOf(a vector) float64 { return math.Sqrt(math.Max(squareOf(a).upper(), 0)) * up }

// keepsApart tells whether a plane that moves with the first shape keeps two shapes apart by a margin.
func (m *motion) keepsApart(first, second *shape, n [3]float64, margin float64) bool {
	require(first.joint <= second.joint && !second.isHalfSpace, "a pair is in the wrong order")
	size := math.Sqrt(inner(n, n))
	require(size >= 0.5 && size <= 2, "a normal has no direction")
	at := m.frames(first.joint)[second.joint-first.joint]
	var turned vector
	for j := range turned {
		turned[j] = dot(vector{at.rows[0][j], at.rows[1][j], at.rows[2][j]}, n)
	}
	offset := dot(at.origin, n)
	far := first.offset
	if !first.isHalfSpace {
		far = first.reach(n, size)
	}
	disc := 0.0
	if second.disc > 0 {
		along := dot(turned, second.axis)
		least := math.Max(math.Max(-along.upper(), -along.times(-1).upper()), 0)
		disc = second.disc * math.Sqrt(math.Max(size*size*up-least*least, 0))
	}
	margin -= 1e-5
	needed := far + second.ball*size + disc + margin*size
	needed += (up - 1) * (math.Abs(far) + (second.ball+math.Abs(margin))*size + disc)
	for _, x := range second.points {
		if !plus(offset, dot(turned, x)).times(-1).isBelow(-needed) {
			return false
		}
	}
	return true
}
