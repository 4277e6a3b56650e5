# SPDX-License-Identifier: Apache-2.0
"""Carrying out a task, as a behaviour tree of py_trees with one state object.

What execution does is an order of fallbacks: from here, from nearer, by way of the middle; set down here, from nearer,
put back; go home, drive back. In a tree each of them is a named subtree that stands once and is used wherever it is
needed (an attempt stands under seven branches), and a failed branch keeps its reason beside it, which is what the
report shows. A table of states would need a row for each of those places and a column that remembers where to return
to. A leaf blocks until it is done, so one tick of the root is one command; nothing else ticks the tree.

Transitions that cut across the branches are values of the state, not exceptions:

* stop: a leaf fails with StoppedError; from then on no leaf begins, and the arm stays where it is;
* recovery: the second child of a fallback whose first one moved; it brings the arm home, and either makes good for the
  failure or leaves it, with its reason, to the branches after it;
* what was left: the next command begins with the way home, or with what is in the hand.

There is no pause: a stop ends the command, and the next one goes on from what was left.
"""
