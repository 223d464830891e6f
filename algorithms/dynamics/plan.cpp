#include "algorithms/dynamics/plan.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "algorithms/dynamics/check_model.hpp"
#include "algorithms/fast/lowering/lowered_model.hpp"
#include "algorithms/fast/translational/translational.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {
namespace {

bool needs_dofs(const Question& question) {
  return !std::all_of(question.want.begin(), question.want.end(), is_of_frames);
}

// Where a joint is locked it stands; a quaternion of no length stands nowhere.
void check_position(const Joint<double>& joint, const std::vector<double>& q,
                    const std::string& name) {
  const int first = joint.q_index, count = q_entries(joint.coordinate);
  for (int i = first; i < first + count; ++i)
    if (!std::isfinite(q[i]))
      throw std::invalid_argument("question: q[" + std::to_string(i) + "] of the locked DoF '" +
                                  name + "' is not finite");
  if (joint.coordinate == Coordinate::quaternion &&
      !is_turn({q[first], q[first + 1], q[first + 2], q[first + 3]}))
    throw std::invalid_argument("question: the quaternion of the locked DoF '" + name +
                                "' has no length");
}

class Planning {
 public:
  Planning(const Model<double>& whole, const Question& question, const std::set<Rule>& rules)
      : whole_(whole), rules_(rules), fate_(whole.nv(), Fate::free) {
    plan_.question = checked(whole, question);
    plan_.nv = whole.nv();
    plan_.partial_answers = rules.contains(Rule::partial_answers);
    if (!question.contacts.empty() && plan_.question.want.contains(Want::log_det) &&
        !(plan_.partial_answers &&
          (question.locked.empty() || rules.contains(Rule::locked_joints))))
      throw std::invalid_argument(
          "question: log det of M with contacts needs the rules partial_answers and locked_joints");
    lock();
    ask();
    drop_trees();
    drop_massless_branches();
    make_parts();
    report_kernels();
    if (plan_.partial_answers) report_partial_answers();
    std::sort(plan_.acted.begin(), plan_.acted.end(),
              [](const Acted& a, const Acted& b) { return a.rule < b.rule; });
  }

  Plan plan() && { return std::move(plan_); }

 private:
  // With `want` and `q` filled.
  static Question checked(const Model<double>& whole, Question question) {
    const auto refuse = [](const std::string& why) {
      throw std::invalid_argument("question: " + why);
    };
    const int nv = whole.nv();
    std::vector<char> locked(nv, 0);
    for (const std::vector<int>* dofs : {&question.locked, &question.dofs}) {
      for (std::size_t i = 0; i < dofs->size(); ++i) {
        const int k = (*dofs)[i];
        if (k < 0 || k >= nv)
          refuse("DoF " + std::to_string(k) + " of a robot with " + std::to_string(nv));
        if (i > 0 && k <= (*dofs)[i - 1]) refuse("DoF are named once, in rising order");
        if (dofs == &question.dofs && locked[k])
          refuse("DoF '" + whole.name(k) + "' is locked and asked about");
        if (dofs == &question.locked) locked[k] = 1;
      }
    }
    for (int k = 1; k < nv; ++k)
      if (whole.joint(k).coordinate == Coordinate::follower && locked[k] != locked[k - 1])
        refuse("DoF '" + whole.name(k) + "': of a joint all DoF are locked or none");
    for (const Frame& frame : question.frames) check_frame("question", frame, nv);
    const auto check_last = [&](const char* what, const std::vector<Frame>& frames) {
      for (const Frame& frame : frames) {
        check_frame("question", frame, nv);
        if (frame.link >= 0 && frame.link + 1 < nv &&
            whole.joint(frame.link + 1).coordinate == Coordinate::follower)
          refuse(std::string(what) + " on DoF '" + whole.name(frame.link) +
                 "', which is not the last of its joint");
      }
    };
    check_last("forces act", question.acted_on);
    check_last("contacts stand", question.contacts);
    check_last("loads hang", question.loaded);
    if (question.q.empty() && question.locked.empty()) question.q.assign(whole.nq(), 0);
    if (static_cast<int>(question.q.size()) != whole.nq())
      refuse("q holds " + std::to_string(question.q.size()) + " numbers, " +
             std::to_string(whole.nq()) + " are needed");
    for (const int k : question.locked) check_position(whole.joint(k), question.q, whole.name(k));
    std::set<Want> want;
    for (const Want one : {Want::acceleration, Want::inverse, Want::diagonal, Want::log_det,
                           Want::mass, Want::operational, Want::operational_diagonal, Want::solve,
                           Want::inverse_dynamics, Want::derivatives})
      if (question.wants(one)) want.insert(one);
    question.want = std::move(want);
    return question;
  }

  VectorX<double> q() const {
    return Eigen::Map<const VectorX<double>>(plan_.question.q.data(), whole_.nq());
  }

  void lock() {
    const Question& question = plan_.question;
    if (rules_.contains(Rule::locked_joints))
      for (const int k : question.locked) fate_[k] = Fate::locked;
    reduced_ = reduce(whole_, fate_, q(), &standing_);
    if (rules_.contains(Rule::locked_joints)) act(Rule::locked_joints, question.locked);

    const Model<double>& model = reduced_.model;
    tree_.resize(model.nv());
    for (int k = 0; k < model.nv(); ++k)
      tree_[k] = model.parent(k) < 0 ? trees_++ : tree_[model.parent(k)];
  }

  void ask() {
    const Question& question = plan_.question;
    std::vector<char> locked(whole_.nv(), 0);
    for (const int k : question.locked) locked[k] = 1;
    if (!question.dofs.empty()) {
      plan_.asked = question.dofs;
    } else if (needs_dofs(question)) {
      for (int k = 0; k < whole_.nv(); ++k)
        if (!locked[k]) plan_.asked.push_back(k);
    }
    asked_.assign(reduced_.model.nv(), 0);
    std::vector<int> reduced_of(whole_.nv(), -1);
    for (int k = 0; k < reduced_.model.nv(); ++k) reduced_of[reduced_.dofs[k]] = k;
    for (const int k : plan_.asked) asked_[reduced_of[k]] = 1;
    sited_.assign(reduced_.model.nv(), 0);
    pushed_ = sited_;
    const auto mark = [&](const std::vector<Frame>& frames, std::vector<char>& links) {
      for (const Frame& frame : frames)
        if (frame.link >= 0 && standing_[frame.link].link >= 0)
          links[standing_[frame.link].link] = 1;
    };
    mark(question.frames, sited_);
    mark(question.acted_on, pushed_);
    mark(question.contacts, pushed_);
    mark(question.loaded, pushed_);
    loaded_.assign(reduced_.model.nv(), 0);
    mark(question.loaded, loaded_);
  }

  void drop_trees() {
    dropped_.assign(reduced_.model.nv(), 0);
    if (!rules_.contains(Rule::untouched_trees) || plan_.question.want.contains(Want::log_det))
      return;
    std::vector<char> touched(trees_, 0);
    for (int k = 0; k < reduced_.model.nv(); ++k) touched[tree_[k]] |= asked_[k] | sited_[k];
    std::vector<int> dofs;
    for (int k = 0; k < reduced_.model.nv(); ++k) {
      if (touched[tree_[k]]) continue;
      dropped_[k] = 1;
      dofs.push_back(reduced_.dofs[k]);
    }
    act(Rule::untouched_trees, dofs);
  }

  // A link without inertia whose branch has none: D = 0 whatever q is.
  void drop_massless_branches() {
    const Model<double>& model = reduced_.model;
    std::vector<char> carries(model.nv(), 0), needed(model.nv(), 0);
    std::vector<int> dofs;
    for (int k = model.nv() - 1; k >= 0; --k) {
      needed[k] |= asked_[k] | sited_[k] | pushed_[k];
      carries[k] |= !model.joint(k).body.massless() || loaded_[k];
      if (model.parent(k) >= 0) {
        carries[model.parent(k)] |= carries[k] | (model.joint(k).r > 0);
        needed[model.parent(k)] |= needed[k];
      }
      if (carries[k] || model.joint(k).r > 0 || dropped_[k]) continue;
      if (needed[k] || !rules_.contains(Rule::massless_branches)) {
        plan_.singular.push_back(reduced_.dofs[k]);
      } else {
        dropped_[k] = 1;
        dofs.push_back(reduced_.dofs[k]);
      }
    }
    std::reverse(dofs.begin(), dofs.end());
    std::reverse(plan_.singular.begin(), plan_.singular.end());
    act(Rule::massless_branches, dofs);
  }

  // Trees apart where their blocks of M or M^-1 are asked for, or where they are solved in another
  // way; the others in one sweep.
  void make_parts() {
    std::vector<int> kept;
    for (int k = 0; k < reduced_.model.nv(); ++k)
      if (!dropped_[k] && std::find(kept.begin(), kept.end(), tree_[k]) == kept.end())
        kept.push_back(tree_[k]);
    const std::set<Want>& want = plan_.question.want;
    const bool blocks = want.contains(Want::inverse) || want.contains(Want::mass) ||
                        want.contains(Want::derivatives);
    std::vector<int> together;
    if (!rules_.contains(Rule::separate_trees) || kept.size() == 1) {
      together = kept;
    } else {
      for (const int tree : kept) {
        Part part = part_of({tree});
        if (blocks || part.kernel == Kernel::translational)
          plan_.parts.push_back(std::move(part));
        else
          together.push_back(tree);
      }
    }
    if (!together.empty()) plan_.parts.push_back(part_of(together));
    if (plan_.parts.size() > 1) act(Rule::separate_trees, remaining());
  }

  std::vector<int> remaining() const {
    std::vector<int> dofs;
    for (int k = 0; k < reduced_.model.nv(); ++k)
      if (!dropped_[k]) dofs.push_back(reduced_.dofs[k]);
    return dofs;
  }

  Part part_of(const std::vector<int>& trees) const {
    std::vector<Fate> fate = fate_;
    for (int k = 0; k < whole_.nv(); ++k) {
      const int link = standing_[k].link;  // of reduced_
      if (link >= 0 &&
          (dropped_[link] || std::find(trees.begin(), trees.end(), tree_[link]) == trees.end()))
        fate[k] = Fate::dropped;
    }
    Part part;
    std::vector<Standing> standing;
    part.reduction = reduce(whole_, fate, q(), &standing);
    for (int k = 0; k < part.reduction.model.nv(); ++k)
      if (std::binary_search(plan_.asked.begin(), plan_.asked.end(), part.reduction.dofs[k]))
        part.asked.push_back(k);
    const auto place = [&](const std::vector<Frame>& frames, std::vector<int>& index,
                           std::vector<Frame>& of_part) {
      for (int i = 0; i < static_cast<int>(frames.size()); ++i) {
        if (frames[i].link < 0 || fate[frames[i].link] == Fate::dropped) continue;
        const Standing& link = standing[frames[i].link];
        if (link.link < 0) continue;
        const Site<long double> site = site_of(frames[i]).cast<long double>();
        const Standing at = link.then(site.rotation, site.translation);
        index.push_back(i);
        of_part.push_back(
            plain(Site<long double>{at.link, at.rotation, at.translation}.cast<double>()));
      }
    };
    place(plan_.question.frames, part.frame_index, part.frames);
    place(plan_.question.acted_on, part.acted_index, part.of_calls.acted_on);
    place(plan_.question.contacts, part.contact_index, part.of_calls.contacts);
    place(plan_.question.loaded, part.loaded_index, part.of_calls.loaded);
    part.kernel = kernel_for(part);
    if (!rules_.contains(Rule::zero_terms)) part.zeros = Zeros::kept;
    part.block = rules_.contains(Rule::partial_answers) &&
                 plan_.question.want.contains(Want::inverse) &&
                 2 * static_cast<int>(part.asked.size()) <= part.reduction.model.nv();
    return part;
  }

  Kernel kernel_for(const Part& part) const {
    if (rules_.contains(Rule::translations) && part.of_calls.acted_on.empty() &&
        part.of_calls.contacts.empty() && part.of_calls.loaded.empty() &&
        is_translational(part.reduction.model))
      return Kernel::translational;
    if (rules_.contains(Rule::rest) && plan_.question.at_rest &&
        plan_.question.want.contains(Want::acceleration))
      return Kernel::spatial_at_rest;
    return Kernel::spatial;
  }

  void report_kernels() {
    for (const Part& part : plan_.parts)
      for (const auto& [kernel, rule] : {std::pair{Kernel::translational, Rule::translations},
                                         std::pair{Kernel::spatial_at_rest, Rule::rest}})
        if (part.kernel == kernel) act(rule, part.reduction.dofs);
    for (const Part& part : plan_.parts)
      if (part.kernel == Kernel::spatial || part.kernel == Kernel::spatial_at_rest)
        act(Rule::zero_terms, links_with_zeros(part));
  }

  static std::vector<int> links_with_zeros(const Part& part) {
    using Tilt = LoweredLink<double>::Tilt;
    const LoweredModel<double> model(part.reduction.model, part.zeros);
    std::vector<int> dofs;
    for (int k = 0; k < model.nv(); ++k)
      if (model.link(k).parent >= 0 && model.link(k).kind == LoweredLink<double>::Kind::screws &&
          model.link(k).tilt != Tilt::any)
        dofs.push_back(part.reduction.dofs[k]);
    return dofs;
  }

  void report_partial_answers() {
    const std::set<Want>& want = plan_.question.want;
    const bool alone = want.contains(Want::diagonal) || want.contains(Want::log_det) ||
                       std::any_of(want.begin(), want.end(), is_of_frames);
    std::vector<int> dofs;
    for (const Part& part : plan_.parts)
      if (alone || part.block)
        dofs.insert(dofs.end(), part.reduction.dofs.begin(), part.reduction.dofs.end());
    act(Rule::partial_answers, dofs);
  }

  // Adds to what the rule has done before.
  void act(Rule rule, const std::vector<int>& dofs) {
    if (dofs.empty()) return;
    auto acted = std::find_if(plan_.acted.begin(), plan_.acted.end(),
                              [&](const Acted& a) { return a.rule == rule; });
    if (acted == plan_.acted.end()) acted = plan_.acted.insert(acted, {rule, {}});
    acted->dofs.insert(acted->dofs.end(), dofs.begin(), dofs.end());
  }

  const Model<double>& whole_;
  const std::set<Rule>& rules_;
  Plan plan_;
  std::vector<Fate> fate_;          // of the whole's links, before anything is dropped
  Reduction reduced_;               // of them
  std::vector<Standing> standing_;  // of the whole's links in reduced_
  std::vector<int> tree_;           // of the links of reduced_
  int trees_ = 0;
  std::vector<char> asked_, sited_, pushed_, loaded_, dropped_;
};

}  // namespace

const std::set<Rule>& model_rules() {
  static const std::set<Rule> rules{Rule::locked_joints, Rule::untouched_trees,
                                    Rule::massless_branches, Rule::separate_trees};
  return rules;
}

std::set<Rule> rules_for(double tolerance) {
  if (tolerance >= least_tolerance_of_double) return all_rules();
  std::set<Rule> rules = model_rules();
  rules.insert({Rule::zero_terms, Rule::partial_answers});
  return rules;
}

Plan make_plan(const Model<double>& whole, const Question& question, const std::set<Rule>& rules) {
  return Planning(whole, question, rules).plan();
}

}  // namespace kalmarm
