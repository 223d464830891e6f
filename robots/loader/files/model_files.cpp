#include "robots/loader/files/model_files.hpp"

#include <strings.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "robots/loader/files/text_file.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

constexpr int most_models = 1000;

fs::path real(const fs::path& path) {
  std::error_code error;
  const fs::path out = fs::canonical(path, error);
  return error ? path : out;
}

std::optional<std::string> beside(const fs::path& folder, const std::string& name) {
  const fs::path path = folder / name;
  if (name.empty() || !is_there(path)) return std::nullopt;
  return path.string();
}

class Search {
 public:
  // The file and what it includes, as one model.
  void model(const std::string& path) {
    const fs::path file = real(path);
    if (std::find(open_.begin(), open_.end(), file) != open_.end())
      throw InputError(path + ": the model attaches itself");
    if (++models_ > most_models)
      throw InputError(path + ": more than " + std::to_string(most_models) +
                       " models are attached");
    open_.push_back(file);
    std::set<fs::path> included = {file};
    one(path, fs::path(path).parent_path().string(), included);
    open_.pop_back();
  }

  std::vector<ModelFile> found() && { return std::move(found_); }

 private:
  void one(const std::string& path, const std::string& model_folder, std::set<fs::path>& included) {
    const ModelFile file{path, read_text(path), model_folder};
    found_.push_back(file);
    for (const XmlTag& tag : xml_tags(file.text)) {
      if (const std::optional<std::string> inner = file.included(tag)) {
        if (included.insert(real(*inner)).second) one(*inner, model_folder, included);
      } else if (const std::optional<std::string> other = file.attached(tag)) {
        model(*other);
      }
    }
  }

  std::vector<ModelFile> found_;
  std::vector<fs::path> open_;  // models, each attached by the one before
  int models_ = 0;
};

}  // namespace

std::optional<std::string> ModelFile::included(const XmlTag& tag) const {
  if (strcasecmp(tag.name.c_str(), "include") != 0) return std::nullopt;
  if (const auto found = beside(model_folder, tag.attribute("file"))) return found;
  return beside(fs::path(path).parent_path(), tag.attribute("file"));
}

std::optional<std::string> ModelFile::attached(const XmlTag& tag) const {
  if (tag.name != "model") return std::nullopt;
  return beside(model_folder, tag.attribute("file"));
}

std::vector<ModelFile> model_files(const std::string& path) {
  Search search;
  search.model(path);
  return std::move(search).found();
}

}  // namespace kalmarm
