/**
 * Which nodes of the octrees are drawn: the ones that look largest, until the budget of points is used up.
 * @typedef {{
 *   key: string, cloud: any, level: number, count: number, spacing: number,
 *   centre: [number, number, number], radius: number, children: Node[] | null, page: any, [more: string]: any
 * }} Node
 */

/** A heap with the largest weight on top. */
export class Heap {
  constructor() {
    /** @type {{weight: number, item: any}[]} */
    this.list = [];
  }
  /** @param {any} item @param {number} weight */
  push(item, weight) {
    const list = this.list;
    list.push({ weight, item });
    let i = list.length - 1;
    while (i > 0) {
      const parent = (i - 1) >> 1;
      if (list[parent].weight >= list[i].weight) break;
      [list[parent], list[i]] = [list[i], list[parent]];
      i = parent;
    }
  }
  pop() {
    const list = this.list;
    const top = list[0];
    const last = list.pop();
    if (list.length && last) {
      list[0] = last;
      for (let i = 0; ; ) {
        const [a, b] = [2 * i + 1, 2 * i + 2];
        let best = i;
        if (a < list.length && list[a].weight > list[best].weight) best = a;
        if (b < list.length && list[b].weight > list[best].weight) best = b;
        if (best === i) break;
        [list[best], list[i]] = [list[i], list[best]];
        i = best;
      }
    }
    return top?.item;
  }
  get size() {
    return this.list.length;
  }
}

/**
 * @param {Node[]} roots
 * @param {{budget: number, pixels: (node: Node) => number, finest: number}} how `pixels` tells how many pixels one metre
 *   takes at a node, 0 when the node is out of sight; below `finest` pixels between points no finer nodes are asked for
 * @returns {{nodes: Node[], points: number, pages: Node[]}} coarse before fine; pages of the hierarchy that are wanted
 */
export function choose(roots, how) {
  const heap = new Heap();
  for (const root of roots) {
    const pixels = how.pixels(root);
    if (pixels > 0) heap.push(root, Infinity);
  }
  const nodes = [];
  const pages = [];
  let points = 0;
  while (heap.size) {
    const node = heap.pop();
    if (node.page) {
      pages.push(node);
      continue;
    }
    if (points + node.count > how.budget) {
      // a root is always worth seeing, whatever the budget says; of the rest smaller ones may still fit
      if (node.level > 0 || nodes.length) continue;
    }
    if (node.count > 0) {
      nodes.push(node);
      points += node.count;
    }
    for (const child of node.children ?? []) {
      const pixels = how.pixels(child);
      if (pixels <= 0) continue;
      if (node.spacing * pixels < how.finest) continue;
      heap.push(child, pixels * child.radius);
    }
  }
  return { nodes, points, pages };
}

/**
 * Nodes of a page of the hierarchy, put into the tree.
 * @param {any} cloud with cube (minimum and edge in the file's coordinates), spacing and nodes (a map by key)
 * @param {{nodes: Record<string, any>, pages: Record<string, any>}} page
 */
export function grown(cloud, page) {
  const made = [];
  for (const [source, isPage] of [[page.nodes, false], [page.pages, true]]) {
    for (const [key, entry] of Object.entries(source)) {
      const [level, x, y, z] = key.split('-').map(Number);
      const edge = cloud.cube.edge / 2 ** level;
      const known = cloud.nodes.get(key);
      const node = known ?? {
        key, cloud, level, count: 0,
        spacing: cloud.spacing / 2 ** level,
        centre: [
          cloud.cube.least[0] + (x + 0.5) * edge,
          cloud.cube.least[1] + (y + 0.5) * edge,
          cloud.cube.least[2] + (z + 0.5) * edge,
        ],
        half: edge / 2, radius: (edge / 2) * Math.sqrt(3), children: null, page: null,
        offset: 0, length: 0, points: null, state: 'none', used: 0,
      };
      if (isPage) node.page = entry;
      else {
        node.page = null;
        node.count = entry.pointCount;
        node.offset = entry.pointDataOffset;
        node.length = entry.pointDataLength;
      }
      if (!known) {
        cloud.nodes.set(key, node);
        made.push({ node, level, x, y, z });
      }
    }
  }
  made.sort((a, b) => a.level - b.level);
  for (const { node, level, x, y, z } of made) {
    if (level === 0) continue;
    const parent = cloud.nodes.get(`${level - 1}-${x >> 1}-${y >> 1}-${z >> 1}`);
    if (parent) (parent.children ??= []).push(node);
  }
}
