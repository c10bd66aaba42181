// The line at the mesh phase, which the server need not know.
mark.setv({ location: cb_obj.value }, { sync: false });
