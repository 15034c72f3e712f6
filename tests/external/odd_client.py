"""A client that breaks the protocol in one way: python3 odd_client.py WAY."""
import json
import os
import signal
import sys
import time

way = sys.argv[1]
scenes = solves = 0
for line in sys.stdin:
    question = json.loads(line)
    answer = {"id": question["id"]}
    if question["ask"] == "hello":
        if way == "no greeting":
            sys.exit("I would rather not")
        answer.update(ricochet=2 if way == "other version" else 1, title="odd", order_smooth=1, order_impacts=1,
                      features=["levitation"] if way == "odd feature" else [])
    elif question["ask"] == "scene":
        scenes += 1
        answer.update(ok=way != "refuses", reason="too hot")
    else:
        solves += 1
        q = question["q0"]
        answer.update(status="success", t=question["T"], q=q, v=[float(scenes), float(solves)][:len(q)], seconds=0.25)
        if way == "counts":
            answer["v"] = [float(100 * scenes + solves)]
        elif way == "crashes":
            print("the last words", file=sys.stderr, flush=True)
            os.kill(os.getpid(), signal.SIGSEGV)
        elif way == "exits":
            sys.exit(3)
        elif way == "is silent":
            time.sleep(60)
        elif way == "talks":
            print("progress: 10 %", flush=True)
        elif way == "short":
            answer["q"] = []
        elif way == "not a number":
            answer["q"] = [float("nan")]
        elif way == "too large":
            answer["q"] = ["1e400"]
        elif way == "other id":
            answer["id"] += 1
        elif way == "ends early":
            answer["t"] = 0.5 * question["T"]
        elif way == "no reason":
            answer["status"] = "infeasible"
        elif way == "gives up":
            answer.update(status="infeasible", message="no way out", t=0.1)
        elif way == "odd status":
            answer["status"] = "happy"
        elif way == "odd event":
            answer["events"] = [{"t": 0.1, "kind": "impact", "contact": 7, "q": q, "v_minus": q, "v_plus": q}]
        elif way == "odd counter":
            answer["counters"] = {"beers": 3}
        elif way == "no seconds":
            del answer["seconds"]
        elif way == "echoes record":
            answer["v"] = [{"final_state": 1.0, "events": 2.0, "grid": 3.0}[question["record"]]]
    print(json.dumps(answer), flush=True)
