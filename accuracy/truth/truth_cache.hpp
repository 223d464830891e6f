// Truth, kept on disk: what was worked out once is read the next time.
//
//   key    = SHA-1 of all that truth depends on: format, T, every parameter, q, tasks, options
//   entry  = FOLDER/<key in hex>.truth:  magic, key, SHA-1 of the content, content
//
// An entry counts if all of this is right and the file is this user's: one that was cut short,
// damaged, renamed, or written by something else is worked out again and replaced. Sizes of vectors and
// matrices are the model's: an entry has none. It is written under a name of its own and then
// renamed, so that any number of processes may share the folder. Where the folder cannot be used
// nothing is kept. Above 150 joints accelerations are kept, matrices are not: with them an entry
// would grow as nv^2.
//
// SHA-1 is the one that comes with Boost, which is here anyway. It guards against accidents: a CRC
// of 32 or 64 bits is too short for a key, and files of others are not read.
#pragma once

#include <filesystem>

#include "accuracy/truth/truth.hpp"

namespace kalmarm {

// $KALMARM_CACHE, else $XDG_CACHE_HOME/kalmarm where that is absolute, as its standard has it, else
// ~/.cache/kalmarm. Empty: no cache, also where $KALMARM_CACHE is set to nothing.
std::filesystem::path cache_folder();

// truth(), from `folder` where it is there.
template <class T>
Truth<T> cached_truth(const Model<T>& model, const VectorX<T>& q, const std::vector<Task<T>>& tasks,
                      const TruthOptions& options = {},
                      const std::filesystem::path& folder = cache_folder());

}  // namespace kalmarm
