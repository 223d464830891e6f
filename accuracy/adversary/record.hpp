// What the adversary writes besides its rounds: mechanisms and states that `evaluate` repeats; rows
// of a CSV.
#pragma once

#include <string>
#include <vector>

#include "accuracy/adversary/judge.hpp"
#include "accuracy/adversary/rounds.hpp"

namespace kalmarm::adversary {

inline constexpr const char* csv_header =
    "variant,precision,task,objective,kernel,rows,seed,method,evaluations,error,kS,nv,file,"
    "bodies\n";

// A row wherever the best so far became better by 5 per cent, with the silent error, or its ratio to
// what was claimed; and one at the end that says of which mechanism it is. Without a find error is
// empty. file: without its ending.
std::string csv_rows(const Asked& asked, const std::vector<Round>& rounds, const Verdict& verdict,
                     const Model<double>& model, const std::string& file);

// The mechanism in a line, for the page to draw: of each body "parent type mass length armature",
// bodies apart by ';'. Parents are counted from 1, 0 is the ground; length is the distance from the
// parent's joint, in m, three digits each.
std::string outline(const Model<double>& model);

// Writes BASE.xml and BASE.json. Throws InputError where the file, read again, is not the same
// mechanism to the last bit.
void write_find(const std::string& base, const Mechanism& mechanism);

// The first number in which two models differ, in words; empty where they are the same.
std::string difference(const Model<double>& a, const Model<double>& b);

}  // namespace kalmarm::adversary
