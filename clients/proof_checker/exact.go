package main

import "math/big"

var (
	one  = big.NewRat(1, 1)
	none = new(big.Rat)
)

func rat(x float64) *big.Rat          { return new(big.Rat).SetFloat64(x) }
func sum(a, b *big.Rat) *big.Rat      { return new(big.Rat).Add(a, b) }
func product(a, b *big.Rat) *big.Rat  { return new(big.Rat).Mul(a, b) }
func quotient(a, b *big.Rat) *big.Rat { return new(big.Rat).Quo(a, b) }
func minus(a *big.Rat) *big.Rat       { return new(big.Rat).Neg(a) }
func size(a *big.Rat) *big.Rat        { return new(big.Rat).Abs(a) }

// power returns a power of an integer.
func power(base *big.Int, exponent int) *big.Int {
	return new(big.Int).Exp(base, big.NewInt(int64(exponent)), nil)
}

// falling returns k (k - 1) ... (k - order + 1).
func falling(k, order int) *big.Int {
	return new(big.Int).MulRange(int64(k-order+1), int64(k))
}

// derivative returns a derivative by time of sum c_k t^k with t = scale u, in powers of u.
func derivative(coefficients []*big.Rat, scale *big.Rat, order int) []*big.Rat {
	var found []*big.Rat
	for k := order; k < len(coefficients); k++ {
		above := new(big.Int).Mul(coefficients[k].Num(), falling(k, order))
		above.Mul(above, power(scale.Num(), k-order))
		below := new(big.Int).Mul(coefficients[k].Denom(), power(scale.Denom(), k-order))
		found = append(found, new(big.Rat).SetFrac(above, below))
	}
	if found == nil {
		found = []*big.Rat{none}
	}
	return found
}

func exact(coefficients []float64) []*big.Rat {
	found := make([]*big.Rat, len(coefficients))
	for k, c := range coefficients {
		found[k] = rat(c)
	}
	return found
}

// whole returns rational numbers as integers over a common denominator.
func whole(row []*big.Rat) ([]*big.Int, *big.Int) {
	common := big.NewInt(1)
	for _, c := range row {
		divisor := new(big.Int).GCD(nil, nil, common, c.Denom())
		common.Mul(common, new(big.Int).Quo(c.Denom(), divisor))
	}
	found := make([]*big.Int, len(row))
	for i, c := range row {
		found[i] = new(big.Int).Mul(c.Num(), new(big.Int).Quo(common, c.Denom()))
	}
	return found, common
}

// bernstein returns the Bernstein coefficients on [0, 1], between whose extremes the polynomial lies,
// as integers over a common denominator.
func bernstein(coefficients []*big.Rat) ([]*big.Int, *big.Int) {
	row, common := whole(coefficients)
	n := int64(len(row) - 1)
	factor := new(big.Int).MulRange(1, n) // a multiple of all binomial coefficients
	for k := range row {
		row[k].Mul(row[k], new(big.Int).Quo(factor, new(big.Int).Binomial(n, int64(k))))
	}
	found := make([]*big.Int, len(row))
	for i := range found {
		found[i] = new(big.Int)
		for k := 0; k <= i; k++ {
			found[i].Add(found[i], new(big.Int).Mul(row[k], new(big.Int).Binomial(int64(i), int64(k))))
		}
	}
	return found, factor.Mul(factor, common)
}

// taylor returns p and its first three derivatives at x = middle + half u, in powers of u, rounded once.
func taylor(coefficients []*big.Rat, middle, half *big.Rat) (found [4][]float64) {
	row, scale := whole(coefficients)
	steps, common := whole([]*big.Rat{middle, half})
	n := len(row) - 1
	for order := range found {
		for k := order; k <= n; k++ {
			total := new(big.Int)
			for i := k; i <= n; i++ {
				term := new(big.Int).Mul(row[i], new(big.Int).Binomial(int64(i), int64(k)))
				term.Mul(term, power(steps[0], i-k))
				total.Add(total, term.Mul(term, power(common, n-i)))
			}
			total.Mul(total, falling(k, order))
			total.Mul(total, power(steps[1], k-order))
			below := new(big.Int).Mul(scale, power(common, n-order))
			x, _ := new(big.Rat).SetFrac(total, below).Float64()
			found[order] = append(found[order], x)
		}
	}
	return found
}

// halves returns positive multiples of the Bernstein coefficients on both halves of an interval.
func halves(row []*big.Int) (left, right []*big.Int) {
	n := len(row)
	left, right = make([]*big.Int, n), make([]*big.Int, n)
	level := row
	for k := 0; k < n; k++ {
		left[k] = new(big.Int).Lsh(level[0], uint(n-1-k))
		right[n-1-k] = new(big.Int).Lsh(level[len(level)-1], uint(n-1-k))
		next := make([]*big.Int, len(level)-1)
		for i := range next {
			next[i] = new(big.Int).Add(level[i], level[i+1])
		}
		level = next
	}
	return left, right
}

// isOneNonnegative tells whether at each u of [0, 1] at least one of some polynomials is not negative.
func isOneNonnegative(polynomials ...[]*big.Rat) bool {
	rows := make([][]*big.Int, len(polynomials))
	for i, each := range polynomials {
		rows[i], _ = bernstein(each)
	}
	return isDecided(rows, 0)
}

func isDecided(rows [][]*big.Int, depth int) bool {
	starts, ends := true, true
	for _, row := range rows {
		positive := true
		for _, c := range row {
			positive = positive && c.Sign() >= 0
		}
		if positive {
			return true
		}
		starts = starts && row[0].Sign() < 0
		ends = ends && row[len(row)-1].Sign() < 0
	}
	if starts || ends || depth == 80 {
		return false
	}
	left, right := make([][]*big.Int, len(rows)), make([][]*big.Int, len(rows))
	for i, row := range rows {
		left[i], right[i] = halves(row)
	}
	return isDecided(left, depth+1) && isDecided(right, depth+1)
}

func value(coefficients []*big.Rat, at *big.Rat) *big.Rat {
	total := new(big.Rat)
	for k := len(coefficients) - 1; k >= 0; k-- {
		total = sum(product(total, at), coefficients[k])
	}
	return total
}

// sineAndCosine computes sine and cosine of a number by their series in integers of 256 binary places.
func sineAndCosine(x float64) (float64, float64) {
	require(x >= -64 && x <= 64, "a joint turns too far")
	const bits = 256
	scale := new(big.Int).Lsh(big.NewInt(1), bits)
	fixed := new(big.Int)
	exactly := rat(x)
	fixed.Div(new(big.Int).Mul(exactly.Num(), scale), exactly.Denom())
	sums := [2]*big.Int{new(big.Int), new(big.Int)}
	term := new(big.Int).Set(scale)
	minusOne := big.NewInt(-1)
	for k := 0; term.Sign() != 0 && term.Cmp(minusOne) != 0; k++ {
		if k%4 < 2 {
			sums[k%2].Add(sums[k%2], term)
		} else {
			sums[k%2].Sub(sums[k%2], term)
		}
		term = new(big.Int).Rsh(term.Mul(term, fixed), bits)
		term.Div(term, big.NewInt(int64(k+1)))
	}
	cosine, _ := new(big.Rat).SetFrac(sums[0], scale).Float64()
	sine, _ := new(big.Rat).SetFrac(sums[1], scale).Float64()
	return sine, cosine
}
