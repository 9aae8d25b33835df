"""Broad phase: which pairs of shapes are near, how long they stay apart, and when they could touch.

All of it is one bound. A gap that was known once is now at least

    that gap - what the surfaces have moved since

and they move no faster than their present motion and their greatest accelerations allow. So most gaps need no look:

scale        since              what has moved                          decides
many steps   `listing`          each body, against its margin           which pairs are listed
many steps   `guards`           A in the frame of B, which turns        which parts are listed, which gaps measured
a step       `passing`          points of A, known at both ends         which trees the engine may move by itself
a step       `implicit`         each body, at most (`BODY.way`)         what an implicit step looks at
a flight     `time_of_impact`   A along the normal of its nearest gap   when a window may begin
substeps     `island`           each body (`BODY.path`)                 which open pairs are measured

A bound may only be too careful: a pair that is looked at for nothing costs time, one that is not is a touch found late.
What is done must not depend on when pairs were listed or looked at: a state that is set back goes on to the bit.
"""
