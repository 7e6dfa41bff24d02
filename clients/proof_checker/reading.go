package main

import (
	"bytes"
	"crypto/sha256"
	"encoding/binary"
	"encoding/hex"
	"encoding/json"
	"fmt"
	"io"
	"math"
	"sort"
	"strconv"
	"strings"
	"unicode/utf8"
)

// A rejection says why a file is not accepted.
type rejection string

func require(holds bool, message string) {
	if !holds {
		panic(rejection(message))
	}
}

const (
	mostBytes = 100_000_000
	mostDepth = 500
)

func parse(text []byte) any {
	require(len(text) <= mostBytes, "the file is too large")
	require(utf8.Valid(text), "the file is not in UTF-8")
	decoder := json.NewDecoder(bytes.NewReader(text))
	decoder.UseNumber()
	value := parseNext(decoder, 0)
	_, err := decoder.Token()
	require(err == io.EOF, "there is something after the JSON value")
	if bytes.Contains(bytes.ToLower(text), []byte(`\ud`)) {
		requirePairs(value)
	}
	return value
}

// parseNext reads a value; its keys must be distinct.
func parseNext(decoder *json.Decoder, depth int) any {
	require(depth < mostDepth, "the file is nested too deeply")
	token, err := decoder.Token()
	require(err == nil, "the file is no JSON")
	switch token {
	case json.Delim('['):
		values := []any{}
		for decoder.More() {
			values = append(values, parseNext(decoder, depth+1))
		}
		_, err = decoder.Token()
		require(err == nil, "the file is no JSON")
		return values
	case json.Delim('{'):
		object := map[string]any{}
		for decoder.More() {
			key := text(parseNext(decoder, depth+1))
			_, known := object[key]
			require(!known, "a key stands twice")
			object[key] = parseNext(decoder, depth+1)
		}
		_, err = decoder.Token()
		require(err == nil, "the file is no JSON")
		return object
	}
	return token
}

// requirePairs rejects texts with half of a surrogate pair, which the decoder has replaced.
func requirePairs(value any) {
	switch v := value.(type) {
	case string:
		require(!strings.ContainsRune(v, utf8.RuneError), "a text is malformed")
	case []any:
		for _, each := range v {
			requirePairs(each)
		}
	case map[string]any:
		for key, each := range v {
			requirePairs(key)
			requirePairs(each)
		}
	}
}

func field(value any, name string) any {
	object, ok := value.(map[string]any)
	require(ok, "an object is missing")
	found, ok := object[name]
	require(ok, "the field "+name+" is missing")
	return found
}

func has(value any, name string) bool {
	object, ok := value.(map[string]any)
	require(ok, "an object is missing")
	_, found := object[name]
	return found
}

func list(value any) []any {
	values, ok := value.([]any)
	require(ok, "a list is missing")
	return values
}

func number(value any) float64 {
	text, ok := value.(json.Number)
	require(ok, "a number is missing")
	x, err := strconv.ParseFloat(string(text), 64)
	require(err == nil, "a number is out of range")
	return x
}

func index(value any, count int) int {
	x := number(value)
	require(x >= 0 && x < float64(count) && x == math.Trunc(x), "an index is out of range")
	return int(x)
}

// numbers reads a list of numbers; with a negative count, of any length.
func numbers(value any, count int) []float64 {
	values := list(value)
	require(count < 0 || len(values) == count, "a list has another length")
	found := make([]float64, len(values))
	for i, each := range values {
		found[i] = number(each)
	}
	return found
}

// A limit may be missing.
type limit struct {
	value float64
	known bool
}

func limitOf(value any) limit {
	if value == nil {
		return limit{}
	}
	return limit{number(value), true}
}

func vector3(value any) [3]float64 {
	return *(*[3]float64)(numbers(value, 3))
}

func matrix3(value any) [3][3]float64 {
	rows := list(value)
	require(len(rows) == 3, "a matrix has another size")
	return [3][3]float64{vector3(rows[0]), vector3(rows[1]), vector3(rows[2])}
}

func text(value any) string {
	found, ok := value.(string)
	require(ok, "a text is missing")
	return found
}

// encode writes a JSON value independently of spaces, of the order of keys and of how its numbers are written.
func encode(value any, into *bytes.Buffer) {
	switch v := value.(type) {
	case nil:
		into.WriteByte('z')
	case json.Number:
		x := number(v)
		if x == 0 {
			x = 0 // no negative zero
		}
		into.WriteByte('n')
		binary.Write(into, binary.BigEndian, x)
	case string:
		fmt.Fprintf(into, "s%d:%s", len(v), v)
	case []any:
		into.WriteByte('[')
		for _, each := range v {
			encode(each, into)
		}
		into.WriteByte(']')
	case map[string]any:
		keys := make([]string, 0, len(v))
		for key := range v {
			keys = append(keys, key)
		}
		sort.Strings(keys)
		into.WriteByte('{')
		for _, key := range keys {
			encode(key, into)
			encode(v[key], into)
		}
		into.WriteByte('}')
	default:
		panic(rejection("a value is no finite number"))
	}
}

func digest(value any) string {
	var buffer bytes.Buffer
	encode(value, &buffer)
	sum := sha256.Sum256(buffer.Bytes())
	return hex.EncodeToString(sum[:])
}
