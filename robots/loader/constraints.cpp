#include "robots/loader/constraints.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "algorithms/model/plain.hpp"
#include "algorithms/model/short_text.hpp"
#include "robots/loader/mujoco_model.hpp"

namespace kalmarm {
namespace {

Vector3<double> vector(const mjtNum* x) { return {x[0], x[1], x[2]}; }
Eigen::Quaternion<double> quaternion(const mjtNum* x) { return {x[0], x[1], x[2], x[3]}; }

std::string name_of(const mjModel* m, int i) {
  if (const char* given = mj_id2name(m, mjOBJ_EQUALITY, i); given && *given) return given;
  std::string out;
  const mjtObj type =
      m->eq_type[i] == mjEQ_JOINT ? mjOBJ_JOINT : static_cast<mjtObj>(m->eq_objtype[i]);
  for (const int id : {m->eq_obj1id[i], m->eq_obj2id[i]})
    if (const char* name = id < 0 ? nullptr : mj_id2name(m, type, id); name && *name)
      out.append(out.empty() ? "" : "-").append(name);
  return out.empty() ? "equality" + std::to_string(i) : out;
}

class Equalities {
 public:
  Equalities(const mjModel* m, const std::vector<LinkFrame>& bodies) : m_(m), bodies_(bodies) {}

  // Those that hold something: what is welded together already needs no constraint.
  std::vector<Constraint> all() const {
    std::vector<Constraint> out;
    if ((m_->opt.disableflags & mjDSBL_EQUALITY) != 0) return out;
    for (int i = 0; i < m_->neq; ++i) {
      if (!m_->eq_active0[i]) continue;
      Constraint one;
      if (m_->eq_type[i] == mjEQ_JOINT)
        one = coupling(i);
      else if (m_->eq_type[i] == mjEQ_CONNECT || m_->eq_type[i] == mjEQ_WELD)
        one = closure(i);
      else
        continue;
      if (one.kind != Constraint::Kind::coupling && one.first.link == one.second.link) continue;
      one.name = name_of(m_, i);
      soften(i, one);
      out.push_back(std::move(one));
    }
    return out;
  }

 private:
  // Where object 1 or 2 of a connect or weld is held.
  LinkFrame place(int i, int which) const {
    const int id = which == 0 ? m_->eq_obj1id[i] : m_->eq_obj2id[i];
    const mjtNum* const data = m_->eq_data + static_cast<std::ptrdiff_t>(i) * mjNEQDATA;
    const bool welds = m_->eq_type[i] == mjEQ_WELD;
    if (m_->eq_objtype[i] == mjOBJ_SITE)
      return bodies_[m_->site_bodyid[id]].then(vector(m_->site_pos + 3 * id),
                                               quaternion(m_->site_quat + 4 * id));
    // anchors of a connect: 1, 2; of a weld: 2, 1, and 1 turned by data[6..9]
    const bool second_anchor = (which == 1) != welds;
    const Eigen::Quaternion<double> turn =
        welds && which == 0 ? quaternion(data + 6) : Eigen::Quaternion<double>::Identity();
    return bodies_[id].then(vector(data + (second_anchor ? 3 : 0)), turn);
  }
  int body(int i, int which) const {
    const int id = which == 0 ? m_->eq_obj1id[i] : m_->eq_obj2id[i];
    return m_->eq_objtype[i] == mjOBJ_SITE ? m_->site_bodyid[id] : id;
  }

  Constraint closure(int i) const {
    const bool welds = m_->eq_type[i] == mjEQ_WELD;
    const LinkFrame first = place(i, 0), second = place(i, 1);
    Constraint out = {.kind = welds ? Constraint::Kind::pose : Constraint::Kind::point,
                      .first = {first.link, plain(first.R), plain(first.p)},
                      .second = {second.link, plain(second.R), plain(second.p)}};
    // MuJoCo's error of a turn is v itself, times the scale of torques
    if (welds) out.turning = m_->eq_data[static_cast<std::ptrdiff_t>(i) * mjNEQDATA + 10] / 2;
    for (const int which : {0, 1}) {
      const mjtNum* const inverse = m_->body_invweight0 + 2 * body(i, which);
      out.compliance[0] += inverse[1];
      out.compliance[1] += inverse[0];
    }
    out.velocity_terms = mjVERSION_HEADER >= 4000000;
    return out;
  }

  Constraint coupling(int i) const {
    Constraint out = {.kind = Constraint::Kind::coupling};
    const mjtNum* const data = m_->eq_data + static_cast<std::ptrdiff_t>(i) * mjNEQDATA;
    const auto add = [&](int joint, std::vector<double>& jacobian) {
      const int dof = m_->jnt_dofadr[joint];
      jacobian.assign(m_->nv, 0);
      jacobian[dof] = 1;
      out.compliance[1] += m_->dof_invweight0[dof];
      return m_->qpos0[m_->jnt_qposadr[joint]];
    };
    std::copy_n(data, 5, out.polynomial.begin());
    out.polynomial[0] += add(m_->eq_obj1id[i], out.jacobian);
    if (m_->eq_obj2id[i] >= 0)
      out.reference = add(m_->eq_obj2id[i], out.other);
    else
      std::fill(out.polynomial.begin() + 1, out.polynomial.end(), 0);
    out.velocity_terms = false;
    return out;
  }

  void soften(int i, Constraint& out) const {
    const mjtNum* const ref = m_->eq_solref + static_cast<std::ptrdiff_t>(i) * mjNREF;
    const mjtNum* const imp = m_->eq_solimp + static_cast<std::ptrdiff_t>(i) * mjNIMP;
    const auto share = [](double d) { return std::clamp<double>(d, mjMINIMP, mjMAXIMP); };
    Impedance d = {.least = share(imp[0]),
                   .most = share(imp[1]),
                   .width = std::max(imp[2], 0.0),
                   .midpoint = share(imp[3]),
                   .power = std::max(imp[4], 1.0)};
    const double d1 = d.most;
    if (d.width <= mjMINVAL) d = {.least = (d.least + d.most) / 2, .most = (d.least + d.most) / 2};
    out.impedance = d;
    if (ref[0] > 0) {
      const bool is_safe = (m_->opt.disableflags & mjDSBL_REFSAFE) == 0;
      const double t = d1 * (is_safe ? std::max(ref[0], 2 * m_->opt.timestep) : ref[0]);
      out.damping = 2 / t;
      out.stiffness = 1 / (t * t * ref[1] * ref[1]);
    } else {
      out.stiffness = -ref[0] / (d1 * d1);
      out.damping = -ref[1] / d1;
    }
  }

  const mjModel* m_;
  const std::vector<LinkFrame>& bodies_;
};

// Links in the world where the file starts. By MuJoCo, since Kinematics is compiled for other instructions than Python's module of the
// loader, in which Eigen's types are aligned otherwise.
class Home {
 public:
  explicit Home(const MujocoModel& model) : links_(model.get()->nv) {
    const mjModel* const m = model.get();
    const std::unique_ptr<mjData, void (*)(mjData*)> data(mj_makeData(m), mj_deleteData);
    std::copy(model.home().q.begin(), model.home().q.end(), data->qpos);
    mj_kinematics(m, data.get());
    const std::vector<LinkFrame> bodies = model.body_frames();
    for (int i = 0; i < m->nbody; ++i) {
      const auto& [link, R, p] = bodies[i];
      if (link < 0) continue;
      const Eigen::Quaternion<double> turn = quaternion(data->xquat + 4 * i) * R.conjugate();
      links_[link] = {link, turn, vector(data->xpos + 3 * i) - turn * p};
    }
  }

  // |e| of a point or a pose.
  double distance(const Constraint& one) const {
    const LinkFrame first = in_world(one.first), second = in_world(one.second);
    const double turned =
        one.kind == Constraint::Kind::pose ? (second.R.conjugate() * first.R).vec().norm() : 0;
    return std::hypot(2 * one.turning * turned, (first.p - second.p).norm());
  }

 private:
  LinkFrame in_world(const Frame& frame) const {
    const LinkFrame link = frame.link < 0 ? LinkFrame{} : links_[frame.link];
    return link.then(Vector3<double>(frame.translation.data()),
                     quaternion_of(frame.rotation).normalized());
  }

  std::vector<LinkFrame> links_;
};

double coupling_error(const LoadedRobot& robot, const Constraint& one) {
  double length = 0, other = -one.reference, P = 0;
  for (int k = 0; k < robot.model.nv(); ++k) {
    const double q = robot.home[robot.model.links[k].q_index];
    length += one.jacobian[k] * q;
    if (!one.other.empty()) other += one.other[k] * q;
  }
  for (int i = 4; i >= 0; --i) P = P * other + one.polynomial[i];
  return std::abs(length - P);
}

}  // namespace

void weigh_constraints(mjModel* model) {
  const std::unique_ptr<mjData, void (*)(mjData*)> data(mj_makeData(model), mj_deleteData);
  mj_setConst(model, data.get());
}

std::string open_at_home(const MujocoModel& model, const LoadedRobot& robot) {
  constexpr double closed = 1e-6;  // [m or rad]: positions of files have about as many digits
  if (robot.constraints.empty()) return "";
  const Home home(model);
  std::string out;
  for (const Constraint& one : robot.constraints) {
    const double open =
        one.kind == Constraint::Kind::coupling ? coupling_error(robot, one) : home.distance(one);
    if (open > closed)
      out += (out.empty() ? "'" : ", '") + one.name + "' by " + short_text("%.2g", open);
  }
  return out;
}

std::vector<Constraint> MujocoModel::constraints() const {
  return Equalities(get(), body_frames()).all();
}

}  // namespace kalmarm
