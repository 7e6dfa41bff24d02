package main

import (
	"math"
	"math/big"
)

const (
	unit = 1.0 / (1 << 53) // relative rounding error of one operation
	up   = 1.0 + 1e-13     // beyond the rounding of a sum of some hundred magnitudes
	tiny = 1e-300          // beyond underflow
)

// A model is a function f on [-1, 1]: a polynomial p, and a remainder r with |f(x) - p(x)| <= r.
type model struct {
	p [6]float64
	r float64
}

type vector [3]model

func constant(x float64) model { return model{p: [6]float64{x}} }

func (m model) isZero() bool { return m == model{} }

func (m model) magnitude() float64 {
	total := 0.0
	for _, c := range m.p {
		total += math.Abs(c)
	}
	return total
}

// modelOf returns the model of a polynomial with coefficients that are rounded once.
func modelOf(coefficients []float64) model {
	var m model
	for k, x := range coefficients {
		require(!math.IsInf(x, 0), "a coefficient is too large")
		if k < len(m.p) {
			m.p[k] = x
			m.r += unit * math.Abs(x)
		} else {
			m.r += math.Abs(x)
		}
	}
	m.r = (m.r + tiny) * up
	return m
}

func plus(f, g model) model {
	var m model
	for k := range m.p {
		m.p[k] = f.p[k] + g.p[k]
	}
	m.r = (f.r + g.r + 2*unit*(f.magnitude()+g.magnitude())) * up
	return m
}

func (m model) times(w float64) model {
	if w == 1 || m.isZero() {
		return m
	}
	if w == 0 {
		return model{}
	}
	var found model
	for k, c := range m.p {
		found.p[k] = w * c
	}
	found.r = (math.Abs(w)*(m.r+2*unit*m.magnitude()) + tiny) * up
	return found
}

func minusModel(f, g model) model { return plus(f, g.times(-1)) }

func multiply(f, g model) model {
	if f.isZero() || g.isZero() {
		return model{}
	}
	var m model
	beyond := 0.0
	for i, a := range f.p {
		for j, b := range g.p {
			if i+j < len(m.p) {
				m.p[i+j] += a * b
			} else {
				beyond += math.Abs(a * b)
			}
		}
	}
	a, b := f.magnitude(), g.magnitude()
	m.r = (beyond + a*g.r + b*f.r + f.r*g.r + 8*unit*a*b + tiny) * up
	return m
}

var toBernstein = func() (rows [6][6]float64) {
	for k := 0; k < 6; k++ {
		// (2 u - 1)^k in powers of u
		power := make([]*big.Rat, 6)
		for j := range power {
			power[j] = new(big.Rat)
		}
		for j := int64(0); j <= int64(k); j++ {
			c := new(big.Int).Binomial(int64(k), j)
			c.Lsh(c, uint(j))
			if (int64(k)-j)%2 == 1 {
				c.Neg(c)
			}
			power[j].SetInt(c)
		}
		row, common := bernstein(power)
		for i, c := range row {
			rows[i][k], _ = new(big.Rat).SetFrac(c, common).Float64()
		}
	}
	return rows
}()

// upper returns an upper bound; the Bernstein coefficients bound the polynomial.
func (m model) upper() float64 {
	peak := math.Inf(-1)
	for _, row := range toBernstein {
		total := 0.0
		for k, w := range row {
			total += w * m.p[k]
		}
		if math.IsNaN(total) {
			return math.NaN()
		}
		peak = math.Max(peak, total)
	}
	rest := (m.r + 1e-15*m.magnitude()) * up
	return peak + rest + 2*unit*(math.Abs(peak)+rest)
}

func (m model) isBelow(limit float64) bool { return m.upper() <= limit }

// turnOf returns sine and cosine of a joint position.
func turnOf(q model) (model, model) {
	sine, cosine := sineAndCosine(q.p[0])
	d := q
	d.p[0] = 0
	size := (d.magnitude() + d.r) * up
	d2 := multiply(d, d)
	d3 := multiply(d2, d)
	d4 := multiply(d2, d2)
	d5 := multiply(d4, d)
	rounding := unit * (math.Pow(size, 3) + math.Pow(size, 5)) * up
	s := plus(plus(d, d3.times(-1.0/6)), d5.times(1.0/120))
	s.r = (s.r + math.Pow(size, 7)/5040*up + rounding) * up
	c := plus(plus(constant(1), d2.times(-0.5)), d4.times(1.0/24))
	c.r = (c.r + math.Pow(size, 6)/720*up + rounding) * up
	s0, c0 := constant(sine), constant(cosine)
	s0.r, c0.r = 2*unit, 2*unit
	return plus(multiply(s0, c), multiply(c0, s)), minusModel(multiply(c0, c), multiply(s0, s))
}

// signOf returns the sign of a velocity; up to 1e-9 it counts as rest.
func signOf(v model) model {
	const rest = 1e-9
	least, most := -v.times(-1).upper(), v.upper()
	low, high := -1.0, 1.0
	if least >= rest {
		low = 1
	} else if least >= -rest {
		low = 0
	}
	if most <= -rest {
		high = -1
	} else if most <= rest {
		high = 0
	}
	sign := constant((low + high) / 2)
	sign.r = (high - low) / 2
	return sign
}

func plusVector(a, b vector) vector {
	return vector{plus(a[0], b[0]), plus(a[1], b[1]), plus(a[2], b[2])}
}

func (a vector) times(w float64) vector { return vector{a[0].times(w), a[1].times(w), a[2].times(w)} }

func constants(a [3]float64) vector { return vector{constant(a[0]), constant(a[1]), constant(a[2])} }

func cross(a, b vector) vector {
	return vector{
		minusModel(multiply(a[1], b[2]), multiply(a[2], b[1])),
		minusModel(multiply(a[2], b[0]), multiply(a[0], b[2])),
		minusModel(multiply(a[0], b[1]), multiply(a[1], b[0])),
	}
}

func dot(a vector, w [3]float64) model {
	return plus(plus(a[0].times(w[0]), a[1].times(w[1])), a[2].times(w[2]))
}

func apply(matrix [3][3]float64, a vector) vector {
	return vector{dot(a, matrix[0]), dot(a, matrix[1]), dot(a, matrix[2])}
}

func transposed(m [3][3]float64) (t [3][3]float64) {
	for i := range m {
		for j := range m {
			t[j][i] = m[i][j]
		}
	}
	return t
}

func squareOf(a vector) model {
	return plus(plus(multiply(a[0], a[0]), multiply(a[1], a[1])), multiply(a[2], a[2]))
}
