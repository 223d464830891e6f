#include "algorithms/generate/preamble.hpp"

#include <type_traits>

#include "algorithms/generate/c_text.hpp"
#include "algorithms/spatial/sincos.hpp"

namespace kalmarm {
namespace {

template <class S>
using Constants = detail::SinCosConstants<S>;

template <class S>
std::string type_of() {
  return std::is_same_v<S, float> ? "float" : "double";
}
template <class S>
std::string root_of() {
  return std::is_same_v<S, float> ? "sqrtf" : "sqrt";
}
template <class S>
std::string farthest() {
  return c_number(Constants<S>::farthest);
}

// c[0] x^n + ... + c[n], by Horner's scheme.
template <class S, int terms>
std::string polynomial(const S (&c)[terms], const std::string& x) {
  std::string out = c_number(c[0]);
  for (int i = 1; i < terms; ++i) {
    if (i > 1) out = "(" + out + ")";
    out += "*" + x + (c[i] < 0 ? " - " : " + ") + c_number(c[i] < 0 ? -c[i] : c[i]);
  }
  return out;
}

// The first lines of sin_cos, by the equations and constants of spatial/sincos.hpp: s and c of x less its quarters of a
// turn.
template <class S>
std::string reduced() {
  using K = Constants<S>;
  const std::string P3 = c_number(K::P3), round = c_number(K::round);
  return "  const number shifted = x*" + c_number(S(0.63661977236758134308)) + " + " + round +
         ";\n  const number turns = shifted - " + round + ";\n  const number t = (x - turns*" +
         c_number(K::P1) + ") - turns*" + c_number(K::P2) + ";\n  const number r = t - turns*" +
         P3 + ";\n  const number low = ((t - r) - turns*" + P3 + ") - turns*" + c_number(K::P4) +
         ";\n  const number rr = r*r;\n  const number s = r + (r*rr*(" + polynomial(K::S, "rr") +
         ") + low);\n  const number c = " + c_number(S(1)) + " - (" + c_number(S(0.5)) +
         "*rr - (rr*rr*(" + polynomial(K::C, "rr") + ") - r*low));\n";
}

// What stands above them. Who calls it has farther angles apart.
template <class S>
std::string head_of_sin_cos(const char* how) {
  return "\n/* x is whole quarters of a turn and r, at most pi/4. Beyond " + farthest<S>() +
         " rad the answer is NaN. */\n" + how +
         " void sin_cos(number x, number *sin_x, number *cos_x)\n{\n";
}

// Once: what is judged of go2 takes 704 ns where 12 copies of it, beyond the first cache, made that 1018.
constexpr const char* not_inline = "#ifdef __GNUC__\n__attribute__((noinline))\n#endif\nstatic";

template <class S>
std::string sin_cos_of_one_state() {
  return head_of_sin_cos<S>(not_inline) + "  if (!(x <= " + farthest<S>() + " && x >= -" +
         farthest<S>() +
         R"()) {
    *sin_x = *cos_x = (x - x)/(x - x);
    return;
  }
)" + reduced<S>() +
         R"(  const int quadrant = (int)turns;
  const number first = quadrant & 1 ? c : s, second = quadrant & 1 ? s : c;
  *sin_x = quadrant & 2 ? -first : first;
  *cos_x = (quadrant + 1) & 2 ? -second : second;
}
)";
}

// The last bits of `shifted` are those of the quarters.
template <class S>
std::string sin_cos_of_rows() {
  return head_of_sin_cos<S>("static inline") + reduced<S>() +
         "  const integers quadrant = (integers)shifted;\n  const integers far = ~((x <= " +
         farthest<S>() + ") & (x >= -" + farthest<S>() +
         R"());
  const integers odd = -(quadrant & 1);
  const number first = chosen(odd, c, s), second = chosen(odd, s, c);
  *sin_x = (number)((integers)chosen(-((quadrant >> 1) & 1), -first, first) | far);
  *cos_x = (number)((integers)chosen(-(((quadrant + 1) >> 1) & 1), -second, second) | far);
}
)";
}

// Vectors that are 2^s apart exchange what is 2^s apart in them, s = 0, 1 and so on.
template <class S>
std::string transpose() {
  std::string out = R"(
/* Lane j of vector i of LANES becomes lane i of vector j. */
#define EXCHANGE(apart, low, high)                        \
  for (int i = 0; i < LANES; ++i)                         \
    if (!(i & apart)) {                                   \
      const number a = x[i], b = x[i + apart];            \
      x[i] = __builtin_shufflevector(a, b, low);          \
      x[i + apart] = __builtin_shufflevector(a, b, high); \
    }
#define LIST(...) __VA_ARGS__
static inline void transpose(number *x)
{
)";
  for (const int bytes : {16, 32, 64}) {
    const int lanes = bytes / static_cast<int>(sizeof(S));
    out += "#if BYTES == " + std::to_string(bytes) + "\n";
    for (int apart = 1; apart < lanes; apart *= 2) {
      std::string low, high;
      for (int i = 0; i < lanes; ++i) {
        const bool second = i & apart;
        const std::string comma = i > 0 ? ", " : "";
        low += comma + std::to_string(second ? lanes + i - apart : i);
        high += comma + std::to_string(second ? lanes + i : i + apart);
      }
      out += "  EXCHANGE(" + std::to_string(apart) + ", LIST(" + low + "), LIST(" + high + "))\n";
    }
    out += "#endif\n";
  }
  return out + "}\n";
}

constexpr const char* operations_of_one_state = R"(
#define all(x) (x)
#define least(a, b) ((a) < (b) ? (a) : (b))
#define with_sign(a, b) ((b) > 0 ? (a) : -(a))
#define zero_where_less(a, b, c) ((a) < (b) ? 0 : (c))
)";

constexpr const char* width_of_vectors = R"(#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(__AVX512F__)
#define BYTES 64
#elif defined(__AVX__)
#define BYTES 32
#else
#define BYTES 16
#endif
)";

constexpr const char* operations_of_rows =
    R"(typedef real number __attribute__((vector_size(BYTES)));
typedef whole integers __attribute__((vector_size(BYTES)));
#define LANES ((int)(BYTES/sizeof(real)))

#define chosen(which, a, b) ((number)(((which) & (integers)(a)) | (~(which) & (integers)(b))))
#define least(a, b) chosen((a) < (b), a, b)
#define with_sign(a, b) chosen((b) > 0, a, -(a))
#define zero_where_less(a, b, c) chosen((a) < (b), all(0), c)

static inline number all(real x) { return x - (number){0}; }
)";

// As spatial/lanes.hpp has it.
constexpr const char* load_and_store = R"(
/* Of so many row-major rows, LANES or fewer, of `left` that can be read: x[j] has number j of each. */
static inline void load(const real *rows, int width, size_t states, size_t left, number *x)
{
  const size_t last = (size_t)(LANES - 1)*width + (LANES > width ? LANES : width);
  if (states == (size_t)LANES && last <= left*width) {
    for (int j = 0; j < width; j += LANES) {
      const int first = width < LANES ? 0 : j < width - LANES ? j : width - LANES;
      number tile[LANES];
      for (int i = 0; i < LANES; ++i) memcpy(&tile[i], rows + i*width + first, sizeof tile[i]);
      transpose(tile);
      for (int i = 0; i < LANES && i < width; ++i) x[first + i] = tile[i];
    }
    return;
  }
  for (int j = 0; j < width; ++j)
    for (int i = 0; i < LANES; ++i)
      x[j][i] = rows[((size_t)i < states ? (size_t)i : states - 1)*width + j];
}

/* To so many rows. What is written beyond the end of a row the next one overwrites. */
static inline void store(const number *x, int width, size_t states, real *rows)
{
  if (states < (size_t)LANES) {
    for (int j = 0; j < width; ++j)
      for (size_t i = 0; i < states; ++i) rows[i*width + j] = x[j][i];
    return;
  }
  for (int j = 0; j < width; j += LANES) {
    const int first = width < LANES ? 0 : j < width - LANES ? j : width - LANES;
    const int end = width < LANES ? width : LANES;
    number tile[LANES];
    for (int i = 0; i < LANES; ++i) tile[i] = i < end ? x[first + i] : all(0);
    transpose(tile);
    for (int i = 0; i < LANES; ++i) {
      real *row = rows + i*width + first;
      if (i*width + first + LANES <= LANES*width)
        memcpy(row, &tile[i], sizeof tile[i]);
      else
        for (int l = 0; l < end; ++l) row[l] = tile[i][l];
    }
  }
}
)";

}  // namespace

template <class S>
std::string preamble_of_one_state(const FunctionsUsed& used) {
  std::string out;
  if (used.roots) {
    const std::string root = root_of<S>();
    out +=
        "#ifdef __GNUC__ /* which needs no header, and where there is an instruction, no library "
        "*/\n#define root __builtin_" +
        root + "\n#else\n#include <math.h>\n#define root " + root + "\n#endif\n\n";
  }
  out += "typedef " + type_of<S>() + " number;\n" + operations_of_one_state;
  return used.sines ? out + sin_cos_of_one_state<S>() : out;
}

template <class S>
std::string preamble_of_rows(const FunctionsUsed& used) {
  std::string out = width_of_vectors;
  out += "typedef " + type_of<S>() + " real;\ntypedef " +
         (std::is_same_v<S, float> ? "int32_t" : "int64_t") + " whole;\n" + operations_of_rows;
  if (used.roots)
    out += "static inline number root(number x)\n{\n  for (int i = 0; i < LANES; ++i) x[i] = " +
           root_of<S>() + "(x[i]);\n  return x;\n}\n";
  if (used.sines) out += sin_cos_of_rows<S>();
  return out + transpose<S>() + load_and_store;
}

template std::string preamble_of_one_state<float>(const FunctionsUsed&);
template std::string preamble_of_one_state<double>(const FunctionsUsed&);
template std::string preamble_of_rows<float>(const FunctionsUsed&);
template std::string preamble_of_rows<double>(const FunctionsUsed&);

}  // namespace kalmarm
