// A tree of links cut into blocks, and the order in which the blocks of a path are combined.
//
// Heavy paths (Sleator and Tarjan, 1983): a path goes from its root outwards, always to the child
// with the most links outboard. What hangs on it else, a light subtree, has at most half of the
// links; it becomes a path of its own, or part of the block that it hangs on where it is small. So
// height(path) = 1 + the largest height of the light paths on it, else 0, is at most log2 N, and all
// paths of one height can be worked on at once.
//
// A path is cut into blocks of about `links_of_block` links, tips to base. A block has one port at
// its root, and one at its tip unless it is the outermost of its path: there the next block is its
// child. A cut is made inboard of a link only where the next link has a body that moves in no
// direction without inertia (mass and all three moments > 0). Why: (4) of covariance_element.hpp.
//
// The blocks of a path are the leaves of a binary tree; combining pairs up this tree and handing
// inputs down it is the scan. The tree is fixed by the model and the options, and with it every
// rounding: no result depends on threads.
#pragma once

#include <algorithm>
#include <vector>

#include "algorithms/model/model.hpp"

namespace kalmarm::scan {

// Where a run of blocks is parted in two.
enum class Order {
  balanced,    // in the middle: depth log2
  tips_first,  // before its last block: one block after another, as the filter runs
  base_first,  // after its first block
};

struct Options {
  int links_of_block = 0;  // 0: by the number of links
  Order order = Order::balanced;
  int threads = 1;
};

// Between 4 and 1024 links, 64 blocks where that does.
inline int default_links_of_block(int nv) { return std::clamp(nv / 64, 4, 1024); }

struct Block {
  struct Attached {
    int position;  // in links, of the link that it hangs on
    int child;     // root of a light path
  };

  std::vector<int> links;  // tips to base; behind every link of the path what hangs on the next
  std::vector<int> ends;   // of the path's links: one past their positions in links
  std::vector<Attached> attached;
  int child = -1;  // root of the next block outboard; -1: the outermost
  int node = -1;   // its leaf

  bool open() const { return child >= 0; }
  int root() const { return links.back(); }
  int tip() const { return links[ends[0] - 1]; }
};

// A run of blocks of one path. right is inboard.
struct Node {
  int left = -1, right = -1;  // nodes
  int block = -1;             // of a leaf
  bool has_inboard = false;   // blocks of the path
  bool has_outboard = false;
};

// All paths of one height.
struct Height {
  std::vector<int> blocks;
  std::vector<int> open_blocks;               // all but the outermost of every path
  std::vector<int> outboard_blocks;           // all but the inmost
  std::vector<std::vector<int>> inner_nodes;  // by depth
};

class Blocks {
 public:
  template <class T>
  Blocks(const Model<T>& model, const Options& options)
      : size_(options.links_of_block > 0 ? options.links_of_block
                                         : default_links_of_block(model.nv())),
        order_(options.order) {
    cut(model);
  }

  const std::vector<Block>& blocks() const { return blocks_; }
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<Height>& heights() const { return heights_; }

  // Of combinations, one after another.
  int depth() const {
    int out = 0;
    for (const Height& height : heights_) out += static_cast<int>(height.inner_nodes.size());
    return out;
  }

 private:
  struct Path {
    int root, height = 0;
  };

  template <class T>
  void cut(const Model<T>& model) {
    const int nv = model.nv();
    std::vector<int> outboard(nv, 1);  // links, with the link itself
    std::vector<std::vector<int>> children(nv);
    for (int k = nv - 1; k >= 0; --k)
      if (const int parent = model.parent(k); parent >= 0) {
        outboard[parent] += outboard[k];
        children[parent].push_back(k);
      }
    for (std::vector<int>& list : children)  // the heavy child first
      std::ranges::stable_sort(list, [&](int a, int b) {
        return outboard[a] != outboard[b] ? outboard[a] > outboard[b] : a < b;
      });

    std::vector<int> roots;
    for (int k = 0; k < nv; ++k)
      if (model.parent(k) < 0) roots.push_back(k);
    std::vector<std::vector<Block>> paths;
    for (std::size_t i = 0; i < roots.size(); ++i)  // light paths are added on the way
      paths.push_back(cut_path(model, roots[i], outboard, children, roots));

    // A light path's root comes behind the root of the path that it hangs on.
    std::vector<int> by_root(roots.size()), height_at(nv, 0);
    for (std::size_t i = 0; i < roots.size(); ++i) by_root[i] = static_cast<int>(i);
    std::ranges::sort(by_root, [&](int a, int b) { return roots[a] > roots[b]; });
    for (const int i : by_root) {
      int& height = height_at[roots[i]];
      for (const Block& block : paths[i])
        for (const Block::Attached& light : block.attached)
          height = std::max(height, 1 + height_at[light.child]);
      add_path(std::move(paths[i]), height);
    }
  }

  // Tips to base.
  template <class T>
  std::vector<Block> cut_path(const Model<T>& model, int root, const std::vector<int>& outboard,
                              const std::vector<std::vector<int>>& children,
                              std::vector<int>& roots) const {
    std::vector<int> path{root};
    while (!children[path.back()].empty()) path.push_back(children[path.back()].front());
    std::vector<Block> out(1);
    for (auto k = path.rbegin(); k != path.rend(); ++k) {
      const RigidBody<T>& body = model.joint(*k).body;
      if (static_cast<int>(out.back().links.size()) >= size_ && body.mass > T(0) &&
          body.moments.minCoeff() > T(0)) {
        const int child = out.back().root();
        out.emplace_back().child = child;
      }
      Block& block = out.back();
      std::vector<int> light;
      for (std::size_t i = 1; i < children[*k].size(); ++i) {
        const int child = children[*k][i];
        if (outboard[child] <= size_ &&
            static_cast<int>(block.links.size()) + outboard[child] < 2 * size_) {
          add_subtree(child, children, block.links);
        } else {
          roots.push_back(child);
          light.push_back(child);
        }
      }
      for (const int child : light)
        block.attached.push_back({static_cast<int>(block.links.size()), child});
      block.links.push_back(*k);
      block.ends.push_back(static_cast<int>(block.links.size()));
    }
    return out;
  }

  // Tips to base.
  static void add_subtree(int root, const std::vector<std::vector<int>>& children,
                          std::vector<int>& links) {
    const auto first = static_cast<std::ptrdiff_t>(links.size());
    links.push_back(root);
    for (auto i = static_cast<std::size_t>(first); i < links.size(); ++i)
      links.insert(links.end(), children[links[i]].begin(), children[links[i]].end());
    std::reverse(links.begin() + first, links.end());
  }

  void add_path(std::vector<Block>&& path, int height) {
    if (static_cast<int>(heights_.size()) <= height) heights_.resize(height + 1);
    Height& at = heights_[height];
    const int first = static_cast<int>(blocks_.size());
    for (Block& block : path) {
      const int i = static_cast<int>(blocks_.size());
      at.blocks.push_back(i);
      if (block.open()) at.open_blocks.push_back(i);
      if (&block != &path.back()) at.outboard_blocks.push_back(i);
      blocks_.push_back(std::move(block));
    }
    add_nodes(first, static_cast<int>(blocks_.size()), at);
  }

  // A node of blocks [first, last) with all below it, level by level: without recursion, since a run
  // that is parted before its last block is as deep as it is long.
  void add_nodes(int first, int last, Height& at) {
    struct Run {
      int node, first, last;
    };
    const int root = static_cast<int>(nodes_.size());
    nodes_.emplace_back();
    std::vector<Run> level{{root, first, last}}, next;
    for (std::size_t depth = 0; !level.empty(); ++depth, level.swap(next), next.clear())
      for (const Run& run : level) {
        if (run.last - run.first == 1) {
          nodes_[run.node].block = run.first;
          blocks_[run.first].node = run.node;
          continue;
        }
        if (at.inner_nodes.size() <= depth) at.inner_nodes.resize(depth + 1);
        at.inner_nodes[depth].push_back(run.node);
        const int middle = order_ == Order::balanced     ? (run.first + run.last) / 2
                           : order_ == Order::tips_first ? run.last - 1
                                                         : run.first + 1;
        const int left = static_cast<int>(nodes_.size());
        Node& node = nodes_[run.node];
        node.left = left;
        node.right = left + 1;
        const Node outer{.has_inboard = true, .has_outboard = node.has_outboard};
        const Node inner{.has_inboard = node.has_inboard, .has_outboard = true};
        nodes_.push_back(outer);
        nodes_.push_back(inner);
        next.push_back({left, run.first, middle});
        next.push_back({left + 1, middle, run.last});
      }
  }

  int size_;
  Order order_;
  std::vector<Block> blocks_;
  std::vector<Node> nodes_;
  std::vector<Height> heights_;
};

}  // namespace kalmarm::scan
