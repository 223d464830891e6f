"""Of stubs, in which a call has overloads and no body: the call is its first overload, and shows the signatures of all."""

import griffe


class Overloads(griffe.Extension):
    def on_class(self, *, cls: griffe.Class, **_) -> None:
        for name, overloads in list(cls.overloads.items()):
            if name not in cls.members:
                first = overloads[0]
                call = griffe.Function(
                    name,
                    parameters=first.parameters,
                    returns=first.returns,
                    docstring=first.docstring,
                    lineno=first.lineno,
                    endlineno=first.endlineno,
                )
                call.overloads = overloads
                cls.set_member(name, call)
