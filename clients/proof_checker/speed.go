package main

import "math"

var atSpeedClaims = []string{"torque_at_speed", "acceleration_at_speed", "jerk_at_speed"}

// A line of a limit by speed: `most` at the speed `low`, less by the slope up to the speed `high`.
type line struct {
	low, most, slope float64
	high             limit
}

// readLines reads the lines of each joint in each segment.
func (p *proof) readLines(value any) (found [][][]line) {
	for _, segment := range list(value) {
		var joints [][]line
		for _, joint := range list(segment) {
			var lines []line
			for _, each := range list(joint) {
				row := list(each)
				require(len(row) == 4, "a line is malformed")
				lines = append(lines, line{number(row[0]), number(row[2]), number(row[3]), limitOf(row[1])})
			}
			joints = append(joints, lines)
		}
		require(len(joints) == p.joints, "a joint has no lines")
		found = append(found, joints)
	}
	return found
}

// isBelowLines tells whether torques, accelerations and jerks keep to their limits by the speeds of the joints.
func (p *proof) isBelowLines(m *motion, segment int) bool {
	for _, name := range atSpeedClaims {
		if !p.claimed[name] {
			continue
		}
		values := m.a
		if name == "torque_at_speed" {
			values = m.actual().torques()
		} else if name == "jerk_at_speed" {
			values = m.j
		}
		for k, lines := range p.atSpeed[name][segment] {
			for _, way := range []float64{-1, 1} {
				speed := m.v[k].times(way)
				least, most := -speed.times(-1).upper(), speed.upper()
				for _, each := range lines {
					if most < each.low || (each.high.known && least > each.high.value) {
						continue
					}
					sunk := plus(speed, constant(-each.low)).times(each.slope)
					allowed := each.most + boundedExcess*math.Abs(each.most)
					if !plus(values[k], sunk).isBelow(allowed) || !plus(values[k].times(-1), sunk).isBelow(allowed) {
						return false
					}
				}
			}
		}
	}
	return true
}
