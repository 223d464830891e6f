#include "accuracy/fits/samples.hpp"

#include <csv.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <memory>
#include <numeric>

#include "accuracy/programs/common/csv.hpp"
#include "robots/loader/files/text_file.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

// Where the columns of a file go: time, then the rows of q, qd, qdd and tau.
std::vector<std::string> column_names(const Model<double>& model) {
  std::vector<std::string> names = {"time"};
  for (const std::string& name : position_names(model)) names.push_back("q:" + name);
  for (const char* kind : {"qd:", "qdd:", "tau:"})
    for (const std::string& name : model.names()) names.push_back(kind + name);
  return names;
}

constexpr std::size_t longest_told = 60;  // characters of a field that is no number

bool is_acceleration(const std::string& column) { return column.starts_with("qdd:"); }
bool is_velocity(const std::string& column) { return column.starts_with("qd:"); }

// Levenshtein's: characters to insert, delete or change.
int edit_distance(const std::string& a, const std::string& b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    int diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const int change = diagonal + (a[i] != b[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({change, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

// The end of a message about `name`; empty where there is nothing to choose from.
std::string nearest(const std::string& name, const std::vector<std::string>& names) {
  if (names.empty()) return "";
  return "; the nearest is '" +
         *std::min_element(names.begin(), names.end(),
                           [&](const std::string& a, const std::string& b) {
                             return edit_distance(name, a) < edit_distance(name, b);
                           }) +
         "'";
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Reads line by line: the header chooses the fields, every further line becomes one sample.
class Reader {
 public:
  Reader(const Model<double>& model, std::string path)
      : model_(model), path_(std::move(path)), names_(column_names(model)) {
    for (std::size_t i = 1; i < names_.size(); ++i)
      if (std::find(names_.begin(), names_.begin() + i, names_[i]) != names_.begin() + i)
        throw InputError(path_ + ": the robot has two joints of the name in '" + names_[i] + "'");
  }

  Samples read() {
    const std::string text = read_text_or_stream(path_);
    const std::size_t mark = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;  // UTF-8's byte order mark

    csv_parser parser;
    if (csv_init(&parser, CSV_STRICT | CSV_STRICT_FINI | CSV_REPALL_NL) != 0)
      throw InputError(path_ + ": no memory to read it");
    const std::unique_ptr<csv_parser, void (*)(csv_parser*)> owner(&parser, csv_free);
    const auto take_field = [](void* field, std::size_t size, void* self) {
      static_cast<Reader*>(self)->row_.emplace_back(static_cast<const char*>(field), size);
    };
    const auto take_line = [](int end, void* self) { static_cast<Reader*>(self)->end_line(end); };
    const std::size_t size = text.size() - mark;
    if (csv_parse(&parser, text.data() + mark, size, take_field, take_line, this) != size ||
        csv_fini(&parser, take_field, take_line, this) != 0)
      if (error_.empty()) error_ = where() + ": a quote is not closed, or stands inside a field";
    if (!error_.empty()) throw InputError(error_);
    return samples();
  }

 private:
  std::string where() const { return path_ + ": line " + std::to_string(line_); }

  // The parser is C: what is wrong is kept until it returns.
  void end_line(int end) {
    try {
      const bool skip = row_.empty() || !error_.empty();
      if (!skip) header_.empty() ? read_header() : read_sample();
    } catch (const InputError& e) {
      error_ = e.what();
    }
    row_.clear();
    line_ += end == '\n';
  }

  void read_header() {
    header_ = row_;
    std::vector<std::string> others;
    std::copy_if(header_.begin(), header_.end(), std::back_inserter(others),
                 [&](const std::string& column) { return !contains(names_, column); });
    accelerations_ = std::any_of(header_.begin(), header_.end(), is_acceleration);
    velocities_ = accelerations_ || std::any_of(header_.begin(), header_.end(), is_velocity);
    for (const std::string& name : names_) {
      if (!accelerations_ && is_acceleration(name)) continue;
      if (!velocities_ && is_velocity(name)) continue;
      const auto found = std::find(header_.begin(), header_.end(), name);
      if (found == header_.end())
        throw InputError(where() + ": no column '" + name + "'" + nearest(name, others));
      if (std::find(found + 1, header_.end(), name) != header_.end())
        throw InputError(where() + ": two columns '" + name + "'");
      fields_.push_back(static_cast<int>(found - header_.begin()));
    }
    for (const std::string& column : others)
      for (const char* kind : {"q:", "qd:", "qdd:", "tau:"})
        if (column.starts_with(kind))
          throw InputError(where() + ": column '" + column + "' is of no joint of the robot" +
                           nearest(column, names_));
  }

  void read_sample() {
    if (row_.size() != header_.size())
      throw InputError(where() + ": " + std::to_string(row_.size()) + " fields, the header has " +
                       std::to_string(header_.size()));
    const std::size_t begin = values_.size(), width = fields_.size();
    for (const int field : fields_) values_.push_back(finite(field));
    if (begin > 0 && !(values_[begin] > values_[begin - width]))
      throw InputError(where() + ": time " + number(values_[begin]) +
                       " is not after the time before it, " + number(values_[begin - width]));
    for (int k = 0; k < model_.nv(); ++k)
      if (model_.joint(k).coordinate == Coordinate::quaternion)
        normalize(values_.data() + begin + 1 + model_.joint(k).q_index, model_.name(k));
  }

  double finite(int field) const {
    const std::string& text = row_[field];
    const bool plus = text.starts_with('+') && !text.starts_with("+-");
    const char* begin = text.data() + plus;
    const char* end = text.data() + text.size();
    double value = 0;
    const auto [stop, error] = std::from_chars(begin, end, value);
    if (error != std::errc() || stop != end || !std::isfinite(value))
      throw InputError(where() + ", column '" + header_[field] + "': '" +
                       text.substr(0, longest_told) + "' is not a finite number");
    return value;
  }

  void normalize(double* entries, const std::string& dof) {
    Eigen::Map<Eigen::Vector4d> quaternion(entries);
    const double norm = quaternion.norm();
    if (!(norm > 1e-10 && std::isfinite(norm)))
      throw InputError(where() + ": the quaternion of '" + dof + "' has length " + number(norm));
    if (std::abs(norm - 1) <= 1e-9) return;  // digits of the file
    quaternion /= norm;
    ++normalized_;
  }

  Samples samples() const {
    const int width = static_cast<int>(fields_.size());
    const int count = width ? static_cast<int>(values_.size()) / width : 0;
    if (count < 2)
      throw InputError(path_ + ": " + std::to_string(count) + " samples, at least two are needed");
    const Eigen::Map<const MatrixX<double>> all(values_.data(), width, count);
    const int nq = model_.nq(), nv = model_.nv();
    Samples out;
    out.time = all.row(0);
    out.q = all.middleRows(1, nq);
    if (velocities_) out.qd = all.middleRows(1 + nq, nv);
    if (accelerations_) out.qdd = all.middleRows(1 + nq + nv, nv);
    out.tau = all.bottomRows(nv);
    out.normalized = normalized_;
    return out;
  }

  const Model<double>& model_;
  std::string path_, error_;
  std::vector<std::string> names_, header_, row_;
  std::vector<int> fields_;     // of the header, in the order of names_
  std::vector<double> values_;  // of the fields, sample after sample
  int line_ = 1, normalized_ = 0;
  bool velocities_ = false, accelerations_ = false;
};

}  // namespace

std::vector<std::string> position_names(const Model<double>& model) {
  std::vector<std::string> names(model.nq());
  for (int k = 0; k < model.nv(); ++k) {
    const int q = model.joint(k).q_index;
    const std::string& name = model.name(k);
    switch (model.joint(k).coordinate) {
      case Coordinate::angle:
      case Coordinate::distance:
        names[q] = name;
        break;
      case Coordinate::position:
        for (int i = 0; i < 3; ++i) names[q + i] = model.name(k + i);
        break;
      case Coordinate::quaternion: {  // its DoF are BALL:x, BALL:y, BALL:z
        const std::string ball = name.substr(0, name.rfind(':'));
        for (int i = 0; i < 4; ++i) names[q + i] = ball + ":q" + "wxyz"[i];
        break;
      }
      case Coordinate::follower:
        break;
    }
  }
  return names;
}

Samples read_samples(const Scene& scene, const std::string& path) {
  return Reader(scene.model, path).read();
}

std::string to_csv(const Scene& scene, const Samples& samples) {
  std::string text;
  for (const std::string& name : column_names(scene.model)) {
    if (is_acceleration(name) && !samples.has_accelerations()) continue;
    if (is_velocity(name) && !samples.has_velocities()) continue;
    if (!text.empty()) text += ',';
    text += field(name);
  }
  for (int i = 0; i < samples.count(); ++i) {
    text += '\n';
    text += number(samples.time[i]);
    for (const MatrixX<double>* rows : {&samples.q, &samples.qd, &samples.qdd, &samples.tau})
      for (int j = 0; j < rows->rows(); ++j) {
        text += ',';
        text += number((*rows)(j, i));
      }
  }
  return text + '\n';
}

namespace {

template <class Columns>
Samples select(const Samples& samples, const Columns& columns) {
  Samples out;
  out.time = samples.time(columns);
  const auto of = [&](const MatrixX<double>& all) -> MatrixX<double> {
    if (all.size() == 0) return {};
    return all(Eigen::all, columns);
  };
  out.q = of(samples.q);
  out.qd = of(samples.qd);
  out.qdd = of(samples.qdd);
  out.tau = of(samples.tau);
  out.mass = of(samples.mass);
  return out;
}

}  // namespace

Samples part(const Samples& samples, int first, int count) {
  return select(samples, Eigen::seqN(first, count));
}

Samples every(const Samples& samples, int stride) {
  return select(samples, Eigen::seqN(0, (samples.count() + stride - 1) / stride, stride));
}

}  // namespace kalmarm
