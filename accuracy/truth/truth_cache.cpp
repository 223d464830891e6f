#include "accuracy/truth/truth_cache.hpp"

#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>

#include "accuracy/programs/common/digest.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

// To be changed with the format, and with anything that changes what truth() gives.
constexpr std::array<char, 8> magic{'k', 'a', 'l', 'm', 'T', 'R', '0', '2'};
constexpr int largest = 150;

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

// Numbers as their bytes, vectors and matrices with their sizes, multi-precision in MPFR's
// interchange format: precision, sign, exponent and limbs.
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
    Real copy = value;  // MPFR asks for what it may change
    mpfr_fpif_export(file_.get(), copy.backend().data());
  }

  template <class Derived>
  void put(const Eigen::MatrixBase<Derived>& A) {
    (*this)(A.rows(), A.cols());
    for (const auto& entry : A.reshaped()) put(entry);
  }

  char* buffer_ = nullptr;
  std::size_t size_ = 0;
  File file_{open_memstream(&buffer_, &size_), std::fclose};
};

// The reverse. False from the first thing on that is not there.
class Reader {
 public:
  explicit Reader(std::string bytes) : bytes_(std::move(bytes)) {}

  template <class... Values>
  bool operator()(Values&... values) {
    return (get(values) && ...);
  }

 private:
  template <class Value>
  requires std::is_arithmetic_v<Value> || std::is_enum_v<Value>
  bool get(Value& value) { return std::fread(&value, sizeof value, 1, file_.get()) == 1; }

  bool get(Real& value) { return mpfr_fpif_import(value.backend().data(), file_.get()) == 0; }

  template <class Derived>
  bool get(Eigen::PlainObjectBase<Derived>& A) {
    Eigen::Index rows, cols;
    if (!(*this)(rows, cols)) return false;
    A.resize(rows, cols);
    for (auto& entry : A.reshaped())
      if (!get(entry)) return false;
    return true;
  }

  std::string bytes_;
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

// All fields of a truth, in one order for writer and reader.
template <class Truth_, class Visitor>
bool visit(Truth_& truth, Visitor&& with) {
  bool ok = with(truth.outcome.status, truth.outcome.joint, truth.outcome.D, truth.outcome.scale,
                 truth.M, truth.X, truth.D, truth.g, truth.digits, truth.width.M, truth.width.X,
                 truth.width.D, truth.width.g);
  for (auto& response : truth.responses)
    ok = ok && with(response.tau, response.a, response.width.relative, response.width.energy,
                    response.width.componentwise, response.kS.relative, response.kS.energy);
  return ok;
}

template <class T>
std::string encoded(const Truth<T>& truth) {
  Writer write;
  write(truth.responses.size());
  visit(truth, [&](const auto&... values) {
    write(values...);
    return true;
  });
  return write.bytes();
}

template <class T>
std::optional<Truth<T>> decoded(std::string content) {
  Reader read(std::move(content));
  Truth<T> out;
  std::size_t responses;
  if (!read(responses)) return {};
  out.responses.resize(responses);
  if (!visit(out, read)) return {};
  return out;
}

// The content of an entry; nothing unless it is whole and has this key.
std::optional<std::string> content_of(const fs::path& path, const Digest& key) {
  std::ifstream file(path, std::ios::binary);
  auto its_magic = magic;
  Digest its_key, its_digest;
  const auto read = [&](auto& bytes) { file.read(bytes.data(), sizeof bytes); };
  read(its_magic);
  read(its_key);
  read(its_digest);
  if (!file || its_magic != magic || its_key != key) return {};
  std::string content(std::istreambuf_iterator<char>(file), {});
  if (digest_of(content) != its_digest) return {};
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
  if (const char* folder = std::getenv("XDG_CACHE_HOME"); folder && *folder)
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
  if (const std::optional<std::string> content = content_of(path, key))
    if (std::optional<Truth<T>> out = decoded<T>(*content)) return *std::move(out);
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
