// Command proofchecker checks proof files of planned trajectories (docs/proof.md) with Go's standard library alone.
//
//	proofchecker FILE [STATEMENT [TRAJECTORY]]   one file, and the digests that it is to have
//	proofchecker -                               files from the standard input, one a line
package main

import (
	"bufio"
	"bytes"
	"fmt"
	"io"
	"os"
	"runtime"
	"strings"
)

// check returns a file whose claims are proved, or why it is rejected.
func check(text []byte, expected []string) (checked *proof, rejected error) {
	defer func() {
		switch fault := recover().(type) {
		case nil:
		case rejection:
			rejected = fmt.Errorf("%s", string(fault))
		case runtime.Error:
			rejected = fmt.Errorf("the file is malformed (%s)", fault)
		default:
			panic(fault)
		}
	}()
	p := readProof(parse(text))
	for i, name := range parts {
		require(i >= len(expected) || p.digests[name] == expected[i], "the "+name+" has another digest than expected")
	}
	p.check()
	return p, nil
}

func main() {
	if len(os.Args) < 2 {
		fmt.Fprintln(os.Stderr, "usage: proofchecker FILE [STATEMENT [TRAJECTORY]]")
		os.Exit(2)
	}
	if os.Args[1] == "-" {
		reader := bufio.NewReader(os.Stdin)
		for {
			line, err := reader.ReadBytes('\n')
			if len(bytes.TrimSpace(line)) > 0 {
				if _, rejected := check(line, nil); rejected != nil {
					fmt.Println("rejected:", rejected)
				} else {
					fmt.Println("accepted")
				}
			}
			if err == io.EOF {
				return
			}
		}
	}
	var text []byte
	file, err := os.Open(os.Args[1])
	if err == nil {
		text, err = io.ReadAll(io.LimitReader(file, mostBytes+1))
	}
	if err == nil {
		var p *proof
		if p, err = check(text, os.Args[2:]); err == nil {
			fmt.Println("accepted:", strings.Join(p.claims, ", "))
			for _, each := range p.notCovered {
				fmt.Println("not covered:", each)
			}
			return
		}
	}
	fmt.Fprintln(os.Stderr, "rejected:", err)
	os.Exit(1)
}
