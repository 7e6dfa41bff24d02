module proofchecker

go 1.19
