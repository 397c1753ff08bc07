"""What is what on a sheet: strokes become named nodes and vectors.

The way of a reading, in `read`:

1. `sketch`: the mechanism is laid on the strokes whole, its links told apart, its joints fitted;
2. `plans`: a plan is drawn in thought from the mechanism *as drawn* (`expected`), as it should be and
   with every mistake, laid where most of its vectors find strokes (`placing`);
3. `matching`: strokes are assigned to vectors one after another, each corrects what is expected of
   the next, so that what follows from a wrong vector is looked for where it follows;
4. `fitting`: nodes are placed by the strokes alone, the expectation has no say in where;
5. `confidence`: how sure each name and place is, from what else could have explained the strokes.

Wrong drawings are read as wrong as they are. What is not found is an `Unread` with its reason.
"""

from grader.reading.read import read_figures

__all__ = ["read_figures"]
