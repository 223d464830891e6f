// KALMARM_EXPORT marks what the compiled library shows; all other symbols in it are hidden, those of
// Eigen's templates among them.
#pragma once

#if defined(__GNUC__)
#define KALMARM_EXPORT [[gnu::visibility("default")]]
#else
#define KALMARM_EXPORT
#endif
