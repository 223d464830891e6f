#include "accuracy/truth/truth_cache.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>

#include "accuracy/programs/common/descriptor.hpp"
#include "accuracy/programs/common/digest.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

// To be changed with the format, and with anything that changes what truth() gives.
constexpr std::array<char, 8> magic{'k', 'a', 'l', 'm', 'T', 'R', '0', '3'};
constexpr int largest = 150;

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

// Bits of a number that truth() may have with so many decimal digits at most.
mpfr_prec_t most_bits(const TruthOptions& options) { return 4 * mpfr_prec_t(options.digits) + 64; }

// Numbers as their bytes, matrices column by column, multi-precision as its precision and its
// hexadecimal digits, which are exact and which MPFR reads from anything without harm.
class Writer {
 public:
  template <class... Values>
  void operator()(const Values&... values) {
    (put(values), ...);
  }

  std::string bytes() {
    std::fflush(file_.get());
    return {buffer_, size_};
  }

  Writer() = default;
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() {
    file_.reset();
    std::free(buffer_);
  }

 private:
  template <class Value>
  requires std::is_arithmetic_v<Value> || std::is_enum_v<Value>
  void put(const Value& value) { std::fwrite(&value, sizeof value, 1, file_.get()); }

  void put(const Real& value) {
    put(mpfr_get_prec(value.backend().data()));
    mpfr_out_str(file_.get(), 16, 0, value.backend().data(), MPFR_RNDN);
    put('\n');
  }

  template <class Derived>
  void put(const Eigen::MatrixBase<Derived>& A) {
    for (const auto& entry : A.reshaped()) put(entry);
  }

  char* buffer_ = nullptr;
  std::size_t size_ = 0;
  File file_{open_memstream(&buffer_, &size_), std::fclose};
};

// The reverse, into matrices that have their sizes: the content has none. False from the first thing on
// that is not there, or has more bits than there can be.
class Reader {
 public:
  Reader(std::string bytes, mpfr_prec_t bits) : bytes_(std::move(bytes)), bits_(bits) {}

  template <class... Values>
  bool operator()(Values&... values) {
    return (get(values) && ...);
  }

  bool at_end() { return std::fgetc(file_.get()) == EOF; }

 private:
  template <class Value>
  requires std::is_arithmetic_v<Value> || std::is_enum_v<Value>
  bool get(Value& value) { return std::fread(&value, sizeof value, 1, file_.get()) == 1; }

  bool get(Real& value) {
    mpfr_prec_t bits;
    if (!get(bits) || bits < MPFR_PREC_MIN || bits > bits_) return false;
    mpfr_set_prec(value.backend().data(), bits);
    return mpfr_inp_str(value.backend().data(), file_.get(), 16, MPFR_RNDN) > 0 &&
           std::fgetc(file_.get()) == '\n';
  }

  template <class Derived>
  bool get(Eigen::PlainObjectBase<Derived>& A) {
    for (auto& entry : A.reshaped())
      if (!get(entry)) return false;
    return true;
  }

  std::string bytes_;
  mpfr_prec_t bits_;
  File file_{fmemopen(bytes_.data(), bytes_.size(), "rb"), std::fclose};
};

template <class T>
Digest key_of(const Model<T>& model, const VectorX<T>& q, const std::vector<Task<T>>& tasks,
              const TruthOptions& options) {
  Writer write;
  for (const char letter : magic) write(letter);
  write(sizeof(T), model.nv(), model.nq(), model.gravity(), q);
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<T>& joint = model.joint(k);
    const RigidBody<T>& body = joint.body;
    write(joint.parent, joint.slides, joint.coordinate, joint.q_index, joint.ref,
          joint.rotation.coeffs(), joint.translation, joint.r, body.mass, body.com,
          body.axes.coeffs(), body.moments);
  }
  write(tasks.size());
  for (const Task<T>& task : tasks) write(task.value, task.qd, task.drive, task.gravity);
  write(options.digits, options.matrices, options.draws);
  return digest_of(write.bytes());
}

// All fields of a truth behind its outcome, in one order for writer and reader.
template <class Truth_, class Visitor>
bool visit(Truth_& truth, Visitor&& with) {
  bool ok = with(truth.M, truth.X, truth.D, truth.g, truth.digits, truth.width.M, truth.width.X,
                 truth.width.D, truth.width.g);
  for (auto& response : truth.responses)
    ok = ok && with(response.tau, response.a, response.width.relative, response.width.energy,
                    response.width.componentwise, response.kS.relative, response.kS.energy);
  return ok;
}

template <class T>
std::string encoded(const Truth<T>& truth) {
  Writer write;
  const Outcome& outcome = truth.outcome;
  write(outcome.status, outcome.joint, outcome.D, outcome.scale);
  visit(truth, [&](const auto&... values) {
    write(values...);
    return true;
  });
  return write.bytes();
}

// What is asked, which has the sizes of everything in an entry.
struct Shape {
  int nv;
  std::size_t tasks;
  const TruthOptions& options;

  // Above any size of an entry: digits and exponents of numbers, and what goes with a task.
  double most_bytes() const {
    const double reals = nv * (2.0 * nv + 7 + tasks);
    return 1000 + reals * (most_bits(options) / 4 + 50) + tasks * (8.0 * nv + 100);
  }

  template <class T>
  void set(Truth<T>& out) const {
    if (!out.outcome) return;
    if (options.matrices) {
      out.M.resize(nv, nv), out.X.resize(nv, nv);
      out.D.resize(nv), out.g.resize(6, nv);
    }
    out.responses.resize(tasks);
    for (Response<T>& response : out.responses) response.tau.resize(nv), response.a.resize(nv);
  }
};

template <class T>
std::optional<Truth<T>> decoded(std::string content, const Shape& shape) {
  Reader read(std::move(content), most_bits(shape.options));
  Truth<T> out;
  Outcome& outcome = out.outcome;
  if (!read(outcome.status, outcome.joint, outcome.D, outcome.scale)) return {};
  const bool known =
      outcome.status >= Outcome::Status::ok && outcome.status <= Outcome::Status::not_finite;
  if (!known || outcome.joint < -1 || outcome.joint >= shape.nv) return {};
  shape.set(out);
  if (!visit(out, read) || !read.at_end()) return {};
  return out;
}

// All of a file of this user's, of `most` bytes or fewer; nothing of what is no file.
std::optional<std::string> own_file(const fs::path& path, double most) {
  // Without waiting for somebody to write, if it is a pipe.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  struct stat status {};
  if (!file || fstat(file.number(), &status) != 0) return {};
  if (!S_ISREG(status.st_mode) || status.st_uid != geteuid() || double(status.st_size) > most)
    return {};
  std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t got = 0;
  while (got < bytes.size()) {
    const ssize_t more = ::read(file.number(), bytes.data() + got, bytes.size() - got);
    if (more <= 0) return {};
    got += static_cast<std::size_t>(more);
  }
  return bytes;
}

// The content of an entry; nothing unless it is whole and has this key.
std::optional<std::string> content_of(const fs::path& path, const Digest& key, double most) {
  const std::optional<std::string> bytes = own_file(path, most);
  const std::string head =
      std::string(magic.begin(), magic.end()) + std::string(key.begin(), key.end());
  if (!bytes || !bytes->starts_with(head) || bytes->size() < head.size() + sizeof(Digest))
    return {};
  std::string content = bytes->substr(head.size() + sizeof(Digest));
  const Digest digest = digest_of(content);
  if (bytes->compare(head.size(), digest.size(), digest.data(), digest.size()) != 0) return {};
  return content;
}

// Failure is silent: the cache is a convenience.
void store(const fs::path& path, const Digest& key, const std::string& content) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  std::string temporary = path.string() + ".XXXXXX";
  const int descriptor = mkstemp(temporary.data());  // makes the name this process's own
  if (descriptor < 0) return;
  close(descriptor);
  const Digest digest = digest_of(content);
  std::ofstream file(temporary, std::ios::binary);
  const auto write = [&](const auto& bytes) { file.write(bytes.data(), sizeof bytes); };
  write(magic);
  write(key);
  write(digest);
  file << content;
  file.close();
  if (file) fs::rename(temporary, path, error);
  if (!file || error) fs::remove(temporary, error);
}

}  // namespace

std::filesystem::path cache_folder() {
  if (const char* folder = std::getenv("KALMARM_CACHE")) return folder;
  if (const char* folder = std::getenv("XDG_CACHE_HOME"); folder && fs::path(folder).is_absolute())
    return fs::path(folder) / "kalmarm";
  if (const char* home = std::getenv("HOME"); home && *home)
    return fs::path(home) / ".cache" / "kalmarm";
  return {};
}

template <class T>
Truth<T> cached_truth(const Model<T>& model, const VectorX<T>& q, const std::vector<Task<T>>& tasks,
                      const TruthOptions& options, const fs::path& folder) {
  if (folder.empty() || (options.matrices && model.nv() > largest))
    return truth(model, q, tasks, options);
  const Digest key = key_of(model, q, tasks, options);
  const fs::path path = folder / (hex(key) + ".truth");
  const Shape shape{model.nv(), tasks.size(), options};
  if (std::optional<std::string> content = content_of(path, key, shape.most_bytes()))
    if (std::optional<Truth<T>> out = decoded<T>(*std::move(content), shape))
      return *std::move(out);
  Truth<T> out = truth(model, q, tasks, options);
  store(path, key, encoded(out));
  return out;
}

template Truth<float> cached_truth(const Model<float>&, const VectorX<float>&,
                                   const std::vector<Task<float>>&, const TruthOptions&,
                                   const fs::path&);
template Truth<double> cached_truth(const Model<double>&, const VectorX<double>&,
                                    const std::vector<Task<double>>&, const TruthOptions&,
                                    const fs::path&);

}  // namespace kalmarm
