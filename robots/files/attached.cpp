#include "robots/files/attached.hpp"

#include <strings.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "robots/files/text_file.hpp"
#include "robots/input_error.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

constexpr int most_models = 1000;

fs::path real(const fs::path& path) {
  std::error_code error;
  const fs::path out = fs::canonical(path, error);
  return error ? path : out;
}

class Attachments {
 public:
  // The file and what it includes, as one model.
  void look_at_model(const fs::path& path, const std::vector<XmlTag>& tags) {
    const fs::path file = real(path);
    if (std::find(open_.begin(), open_.end(), file) != open_.end())
      throw InputError(path.string() + ": the model attaches itself");
    if (++models_ > most_models)
      throw InputError(path.string() + ": more than " + std::to_string(most_models) +
                       " models are attached");
    open_.push_back(file);
    std::set<fs::path> included = {file};
    look_at_tags(path.parent_path(), path.parent_path(), tags, included);
    open_.pop_back();
  }

 private:
  // MuJoCo looks for files beside the model, and for those to include beside what includes them.
  void look_at_tags(const fs::path& model_folder, const fs::path& folder,
                    const std::vector<XmlTag>& tags, std::set<fs::path>& included) {
    for (const XmlTag& tag : tags) {
      const std::string name = tag.attribute("file");
      const bool includes = strcasecmp(tag.name.c_str(), "include") == 0;
      if (name.empty() || (!includes && tag.name != "model")) continue;
      fs::path path = model_folder / name;
      if (includes && !is_there(path)) path = folder / name;
      if (!is_there(path)) continue;
      if (includes && !included.insert(real(path)).second) continue;
      const std::vector<XmlTag> inner = xml_tags(read_text(path.string()));
      if (includes)
        look_at_tags(model_folder, path.parent_path(), inner, included);
      else
        look_at_model(path, inner);
    }
  }

  std::vector<fs::path> open_;  // models, each attached by the one before
  int models_ = 0;
};

}  // namespace

void refuse_bad_attachments(const std::string& path, const std::vector<XmlTag>& tags) {
  Attachments().look_at_model(path, tags);
}

}  // namespace kalmarm
